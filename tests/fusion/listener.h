// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "core/progress.h"

namespace polarscan {

// Keeps what a stage warns of.
class Listener : public Progress {
 public:
  void Warn(const std::string& message) override { warnings += message + "\n"; }
  std::string warnings;
};

}  // namespace polarscan
