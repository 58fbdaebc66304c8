// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace polarscan {

// One of `count` programs that share the views of a workspace on one file system: view v is that of shard v
// mod count.
struct Shard {
  int index = 0, count = 1;
  double patience_s = 3600;  // without a new map from the others, where theirs are needed

  // How many of so many views are this shard's.
  int Share(int views) const { return (views - index + count - 1) / count; }
};

}  // namespace polarscan
