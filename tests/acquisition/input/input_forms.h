// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "input/input_folder.h"

namespace polarscan {

inline constexpr const char* kSony = "90 45 / 135 0";

class InputFormsTest : public InputTest {
 protected:
  void File(const std::string& name, const std::string& bytes) const {
    WriteFileAtomically(folder_ / name, bytes);
  }
  Input OpenMosaics() const { return Open({.layout = kSony}); }
  float ValueOf(const Input& input, int view, std::size_t picture = 0, std::size_t plane = 0) const {
    return ReadView(input, view).pictures.at(picture).planes.at(plane)(1, 2);
  }
};

inline std::string Joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

}  // namespace polarscan
