// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "core/formats/image_io.h"
#include "program.h"

namespace polarscan::test {

class DemosaicCommand : public testing::Test {
 protected:
  std::filesystem::path Input() const { return folder_ / "input"; }
  std::filesystem::path Views() const { return folder_ / "views"; }

  // Four angle folders; the light of the view behind a polarizer is (s0 + s1 cos 2a + s2 sin 2a) / 2 of full
  // scale.
  void WriteAngles(const std::string& view, double s0, double s1, double s2) const {
    for (const int angle : {0, 45, 90, 135}) {
      const double turn = 2 * angle * std::numbers::pi / 180;
      const double light = (s0 + s1 * std::cos(turn) + s2 * std::sin(turn)) / 2;
      WritePng(Input() / ("I-" + std::to_string(angle)) / (view + ".png"),
               Image<std::uint16_t>(40, 30, std::uint16_t(std::lround(65535 * light))));
    }
  }
  Outcome Run(std::vector<std::string> options = {"--bits", "16"}) const {
    std::vector<std::string> arguments = {"demosaic", Input().string(), "-o", Views().string()};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return RunPolarscan(arguments);
  }
  std::filesystem::file_time_type Age(const std::string& name) const {
    return std::filesystem::last_write_time(Views() / name);
  }

  TemporaryFolder folder_;
};

}  // namespace polarscan::test
