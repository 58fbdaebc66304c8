// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "acquisition/input/input.h"
#include "core/error.h"
#include "core/files/files.h"

namespace polarscan {

// A folder of its own for each test, removed afterwards.
class InputTest : public testing::Test {
 protected:
  InputTest() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("polarscan-input-") + test->name() + std::to_string(::getpid()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~InputTest() override { std::filesystem::remove_all(folder_); }

  void Grey8(const std::string& name, int width = 8, int height = 6, int value = 100) const {
    WritePng(folder_ / name, Image<std::uint8_t>(width, height, std::uint8_t(value)));
  }
  void Grey16(const std::string& name, int value, int width = 8, int height = 6) const {
    WritePng(folder_ / name, Image<std::uint16_t>(width, height, std::uint16_t(value)));
  }
  void Colour(const std::string& name) const { WritePng(folder_ / name, Image<Rgb8>(8, 6, {200, 100, 50})); }
  void Floats(const std::string& name, std::size_t pages) const {
    const Image<float> page(8, 6, 0.5f);
    WriteFloatTiff(folder_ / name, std::vector<const Image<float>*>(pages, &page));
  }
  void Angles(const std::vector<std::string>& views) const {
    for (const char* angle : {"I-00", "I-45", "I-90", "I-135"})
      for (const std::string& view : views) Grey8(std::string(angle) + "/" + view + ".png");
  }
  void Set(const std::string& json) const { WriteFileAtomically(folder_ / "set.json", json); }

  Input Open(const InputOptions& options = {}) const { return OpenInput(folder_, options); }
  // The message of the error that opening the folder and reading all its views throws; empty if none.
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

inline bool Says(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}
#define EXPECT_SAYS(text, part) EXPECT_PRED2(Says, text, part)

inline std::vector<std::string> Names(const Input& input) {
  std::vector<std::string> names;
  for (const InputView& view : input.views) names.push_back(view.name);
  return names;
}

using List = std::vector<std::string>;

}  // namespace polarscan
