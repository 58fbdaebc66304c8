// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <filesystem>
#include <string>

namespace polarscan {

// The name of a picture's view: its path as seen from the set's folder, without extension and with - for /:
// "cam1-0" of cam1/0.jpg. It is a file's name in all that follows, so it has no folders.
inline std::string ViewName(const std::filesystem::path& below) {
  std::string name = (below.parent_path() / below.stem()).generic_string();
  std::ranges::replace(name, '/', '-');
  return name;
}

}  // namespace polarscan
