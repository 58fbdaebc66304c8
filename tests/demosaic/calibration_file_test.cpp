// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>

#include "core/error.h"
#include "core/files/files.h"
#include "demosaic/calibration/calibration.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

class CalibrationFile : public testing::Test {
 protected:
  CalibrationFile() {
    std::string name = (fs::temp_directory_path() / "polarscan-calibration-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    calibration_.sensor.layout = ParseLayout("90 45 / 135 0");
    calibration_.sensor.bits = 12, calibration_.sensor.white_dn = 4000, calibration_.sensor.black_dn = 60.25;
    calibration_.binding = MakeBinding({{"vendor", "V"}, {"serial", "17"}, {"id", "10.0.0.1"}},
                                       {{"Gain", 6.0}, {"ExposureTime", 100}, {"OffsetX", 8}}, 6, 4,
                                       calibration_.sensor.layout, 12);
    calibration_.correction.black_dn = Image<float>(6, 4, 60.5f);
    calibration_.correction.responses = IdealResponses(6, 4, calibration_.sensor.layout);
    calibration_.parts["dark"] = {{"frames", 16}};
  }
  ~CalibrationFile() override { fs::remove_all(folder_); }

  std::string ErrorOf(const std::function<void()>& f) const {
    try {
      f();
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  }
  void Replace(const std::string& file, const std::string& what, const std::string& by) const {
    std::string bytes = ReadFile(folder_ / file);
    const std::size_t at = bytes.find(what);
    ASSERT_NE(at, std::string::npos);
    WriteFileAtomically(folder_ / file, bytes.replace(at, what.size(), by));
  }
  fs::path Maps() const {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_))
      if (entry.path().extension() == ".tif") return entry.path();
    return {};
  }

  fs::path folder_;
  Calibration calibration_;
};

TEST_F(CalibrationFile, ComesBackAsItWasWritten) {
  WriteCalibration(folder_, calibration_);
  const Calibration read = ReadCalibration(folder_);
  EXPECT_EQ(read.hash, calibration_.hash);
  EXPECT_EQ(HashOf(read.binding), HashOf(calibration_.binding));
  EXPECT_EQ(read.sensor.black_dn, 60.25);
  EXPECT_EQ(read.parts, calibration_.parts);
  EXPECT_TRUE(
      std::ranges::equal(read.correction.black_dn.pixels(), calibration_.correction.black_dn.pixels()));
  EXPECT_TRUE(std::ranges::equal(read.correction.responses.a2.pixels(),
                                 calibration_.correction.responses.a2.pixels()));
}

TEST_F(CalibrationFile, WrittenAgainHoldsOneSetOfMaps) {
  WriteCalibration(folder_, calibration_);
  const fs::path first = Maps();
  calibration_.correction.black_dn(3, 3) = 61;
  WriteCalibration(folder_, calibration_);
  EXPECT_FALSE(fs::exists(first));
  EXPECT_EQ(ReadCalibration(folder_).correction.black_dn(3, 3), 61);
}

TEST_F(CalibrationFile, DamageIsFoundInEveryFile) {
  WriteCalibration(folder_, calibration_);
  Replace("calibration.json", "4000", "4001");
  EXPECT_NE(ErrorOf([&] { ReadCalibration(folder_); }).find("changed by hand"), std::string::npos);
  WriteCalibration(folder_, calibration_);
  std::string bytes = ReadFile(Maps());
  bytes[bytes.size() / 2] ^= 1;
  WriteFileAtomically(Maps(), bytes);
  EXPECT_NE(ErrorOf([&] { ReadCalibration(folder_); }).find("maps are damaged"), std::string::npos);
  fs::remove(Maps());
  EXPECT_NE(ErrorOf([&] { ReadCalibration(folder_); }).find("maps are missing"), std::string::npos);
  EXPECT_NE(ErrorOf([&] { ReadCalibration(folder_ / "no"); }).find("no calibration"), std::string::npos);
}

TEST_F(CalibrationFile, IsBoundToCameraAndSettings) {
  const Layout layout = ParseLayout("90 45 / 135 0");
  const auto error = [&](const nlohmann::json& camera, const nlohmann::json& features, int width = 6,
                         const Layout& cell = ParseLayout("90 45 / 135 0"), int bits = 12) {
    return ErrorOf([&] {
      RequireSame(calibration_.binding, MakeBinding(camera, features, width, 4, cell, bits), "pictures");
    });
  };
  EXPECT_EQ(error({{"serial", "17"}, {"id", "10.0.0.9"}}, {{"Gain", 6}, {"ExposureTime", 5}}), "no error");
  EXPECT_EQ(error(nlohmann::json::object(), nlohmann::json::object()), "no error");
  EXPECT_NE(error({{"serial", "18"}}, {}).find("serial 18 instead of 17"), std::string::npos);
  EXPECT_NE(error({}, {{"Gain", 12}}).find("Gain 12 instead of 6"), std::string::npos);
  const std::string several = error({}, {{"OffsetX", 16}}, 8);
  EXPECT_NE(several.find("OffsetX 16 instead of 8"), std::string::npos) << several;
  EXPECT_NE(several.find("width 8 instead of 6"), std::string::npos) << several;
  EXPECT_NE(error({}, {}, 6, ParseLayout("0 45 / 135 90")).find("layout"), std::string::npos);
  EXPECT_NE(error({}, {}, 6, layout, 8).find("bits 8 instead of 12"), std::string::npos);
}

}  // namespace
}  // namespace polarscan
