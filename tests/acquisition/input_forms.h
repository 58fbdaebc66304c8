// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "acquisition/input/input.h"
#include "core/error.h"
#include "core/files.h"

namespace polarscan {

inline constexpr const char* kSony = "90 45 / 135 0";

class InputFormsTest : public testing::Test {
 protected:
  InputFormsTest() {
    folder_ = std::filesystem::temp_directory_path() / ("polarscan-forms-" + std::to_string(::getpid()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~InputFormsTest() override { std::filesystem::remove_all(folder_); }

  void Grey8(const std::string& name, int value = 100, int width = 8, int height = 6) const {
    WritePng(folder_ / name, Image<std::uint8_t>(width, height, std::uint8_t(value)));
  }
  void Colour(const std::string& name) const { WritePng(folder_ / name, Image<Rgb8>(8, 6, {200, 100, 50})); }
  void File(const std::string& name, const std::string& bytes) const {
    WriteFileAtomically(folder_ / name, bytes);
  }
  Input Open(const InputOptions& options = {}) const { return OpenInput(folder_, options); }
  Input OpenMosaics() const { return OpenInput(folder_, {.layout = kSony}); }
  float ValueOf(const Input& input, int view, std::size_t picture = 0, std::size_t plane = 0) const {
    return ReadView(input, view).pictures.at(picture).planes.at(plane)(1, 2);
  }
  std::string Complaint(const InputOptions& options = {}) const {
    try {
      const Input input = Open(options);
      for (int view = 0; view < int(input.views.size()); ++view) ReadView(input, view);
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  }

  std::filesystem::path folder_;
};

inline bool Holds(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}
#define EXPECT_HOLDS(text, part) EXPECT_PRED2(Holds, text, part)

inline std::vector<std::string> ViewNames(const Input& input) {
  std::vector<std::string> names;
  for (const InputView& view : input.views) names.push_back(view.name);
  return names;
}

inline std::string Joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

using NameList = std::vector<std::string>;

}  // namespace polarscan
