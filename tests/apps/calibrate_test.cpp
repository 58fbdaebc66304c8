// SPDX-License-Identifier: Apache-2.0
// polarscan calibrate as a user meets it: frames of a made-up sensor in, calibrated views out, and what is
// said where frames and calibration do not fit.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "../demosaic/imperfect_sensor.h"
#include "acquisition/session/session_writer.h"
#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "demosaic/sensor/pixel_format.h"
#include "demosaic/stokes.h"
#include "program.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;
constexpr int kSensorWidth = 96, kSensorHeight = 64, kSceneViews = 6;
constexpr double kSceneDop = 0.5;

double TrueAopDeg(int view) { return 11 + 29.0 * view; }

Image<std::uint16_t> ToFile(const Image<float>& counts) {
  Image<std::uint16_t> image(counts.width(), counts.height());
  for (std::size_t i = 0; i < image.size(); ++i) image.pixels()[i] = std::uint16_t(counts.pixels()[i]);
  return image;
}

// A camera with noise of 1 % of full scale in the frames of light, 0.1 % in the dark ones. Those of the scene
// have none, so that they show what calibration leaves.
class Calibrate : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    suite_ = std::make_unique<TemporaryFolder>();
    ImperfectSensor camera = Camera();
    camera.noise = 0.001;  // of reading
    for (int k = 0; k < 8; ++k) Write("dark", std::to_string(k), camera.Take(Dark, 50 + std::uint64_t(k)));
    camera.noise = 0.01;
    for (int k = 0; k < 8; ++k)
      Write("flat", std::to_string(k),
            camera.Take(
                [k](int, int, char) {
                  return Stokes{0.3 + 0.3 * (k / 2), 0, 0};
                },
                std::uint64_t(k)));
    for (int k = 0; k < 36; ++k)
      Write("polarizer", fmt::format("angle_{:03}", 5 * k),
            camera.Take(BehindPolarizer(5 * k), 100 + std::uint64_t(k)));
    camera.noise = 0;
    for (int view = 0; view < kSceneViews; ++view) {
      const double turn = 2 * TrueAopDeg(view) * kRadPerDeg;
      Write("scene", std::to_string(view), camera.Take([&](int, int, char) {
        return Stokes{0.8, 0.8 * kSceneDop * std::cos(turn), 0.8 * kSceneDop * std::sin(turn)};
      }));
    }
    for (const char* set : {"dark", "flat", "polarizer", "scene"}) Describe(set, "17", 12, 3);
  }
  static void TearDownTestSuite() { suite_.reset(); }

  static ImperfectSensor Camera() {
    ImperfectSensor camera(kSensorWidth, kSensorHeight, 21);
    camera.black_dn = Image<float>(kSensorWidth, kSensorHeight);
    for (std::size_t i = 0; i < camera.black_dn.size(); ++i)
      camera.black_dn.pixels()[i] = float(60 + 4 * Random(4, i).Normal());
    return camera;
  }
  static Stokes Dark(int, int, char) { return {0, 0, 0}; }
  static fs::path Set(const std::string& name) { return *suite_ / name; }
  static void Write(const std::string& set, const std::string& name, const Image<float>& counts) {
    WritePng(Set(set) / "mosaic" / (name + ".png"), ToFile(counts));
  }
  static void Describe(const std::string& set, const std::string& serial, int bits, double gain) {
    WriteJson(
        Set(set) / "set.json",
        {{"sensor", {{"layout", "90 45 / 135 0"}, {"bits", bits}, {"black_dn", 60}, {"white_dn", 4095}}},
         {"camera", {{"vendor", "made up"}, {"serial", serial}}},
         {"settings", {{"Gain", gain}, {"ExposureTime", 100}}}});
  }
  // A copy of the scene that says other things about itself.
  static fs::path OtherScene(const std::string& name, const std::string& serial, int bits, double gain) {
    fs::copy(Set("scene"), Set(name), fs::copy_options::recursive);
    Describe(name, serial, bits, gain);
    return Set(name);
  }

  fs::path Calibration() const { return folder_ / "camera-17"; }
  Outcome Run(const std::string& step, const std::string& set,
              const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments = {"calibrate", step, Set(set).string(), "-o", Calibration().string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunPolarscan(arguments);
  }
  void CalibrateAll(const std::string& angles) const {
    for (const auto& [step, more] : std::vector<std::pair<std::string, std::vector<std::string>>>{
             {"dark", {}}, {"flat", {"--unpolarized"}}, {"polarizer", {"--angles", angles}}}) {
      const Outcome outcome = Run(step, step, more);
      ASSERT_EQ(outcome.exit_code, kDone) << outcome.err;
    }
  }
  Outcome Demosaic(const fs::path& input, const std::string& views, bool calibrated) const {
    std::vector<std::string> arguments = {"demosaic", input.string(), "-o", (folder_ / views).string()};
    if (calibrated) arguments.insert(arguments.end(), {"--calibration", Calibration().string()});
    return RunPolarscan(arguments);
  }
  // Root mean square error of AoP over all views, degrees; the border, where bilinear has fewer samples, too.
  double AopErrorOf(const std::string& views) const {
    double sum = 0, count = 0;
    for (int view = 0; view < kSceneViews; ++view) {
      const StokesImage image = ReadStokes(folder_ / views / (std::to_string(view) + ".tif"));
      for (std::size_t i = 0; i < image.s0.size(); ++i) {
        const double aop = AngleOfPolarization(image.s1.pixels()[i], image.s2.pixels()[i]) / kRadPerDeg;
        const double error = std::remainder(aop - TrueAopDeg(view), 180);
        sum += error * error, ++count;
      }
    }
    return std::sqrt(sum / count);
  }
  double DopErrorOf(const std::string& views) const {
    const StokesImage image = ReadStokes(folder_ / views / "0.tif");
    double sum = 0;
    for (std::size_t i = 0; i < image.s0.size(); ++i)
      sum +=
          DegreeOfPolarization(image.s0.pixels()[i], image.s1.pixels()[i], image.s2.pixels()[i]) - kSceneDop;
    return sum / double(image.s0.size());
  }
  static void ExpectFailure(const Outcome& outcome, const std::vector<std::string>& words) {
    EXPECT_EQ(outcome.exit_code, kFailed) << outcome.err;
    for (const std::string& word : words)
      EXPECT_NE(outcome.err.find(word), std::string::npos) << word << "\n" << outcome.err;
  }

  static inline std::unique_ptr<TemporaryFolder> suite_;
  TemporaryFolder folder_;
};

// The project's bar: the error of AoP is at least 4 times smaller, by known angles and by unknown ones.
TEST_F(Calibrate, DarkFlatAndPolarizerFramesMakeTheErrorOfAopFourTimesSmaller) {
  ASSERT_EQ(Demosaic(Set("scene"), "before", false).exit_code, kDone);
  CalibrateAll("names");
  ASSERT_EQ(Demosaic(Set("scene"), "known", true).exit_code, kDone);
  CalibrateAll("unknown");
  ASSERT_EQ(Demosaic(Set("scene"), "unknown", true).exit_code, kDone);
  const double before = AopErrorOf("before"), known = AopErrorOf("known"), unknown = AopErrorOf("unknown");
  std::printf(
      "AoP error through the program: %.3f deg uncalibrated, %.3f known angles (%.1f times less), %.3f "
      "unknown ones\n",
      before, known, before / known, unknown);
  EXPECT_GT(before / known, 4);
  EXPECT_LT(unknown, 1.1 * known);
  EXPECT_LT(DopErrorOf("before"), -0.01);  // diattenuation 0.97
  EXPECT_NEAR(DopErrorOf("known"), 0, 0.002);
}

TEST_F(Calibrate, SaysWhatItFound) {
  CalibrateAll("names");
  const Outcome dark = Run("dark", "dark", {"--json"});
  EXPECT_NE(dark.err.find("run polarscan calibrate polarizer again"), std::string::npos) << dark.err;
  const json dark_found = json::parse(dark.out)["dark"];
  EXPECT_NEAR(dark_found["black_dn"], 60, 0.3);
  EXPECT_NEAR(dark_found["pixel_spread_dn"], 4, 0.4);
  const Outcome polarizer = Run("polarizer", "polarizer", {"--json", "--angles", "0:5"});
  const json found = json::parse(polarizer.out)["polarizer"];
  EXPECT_NEAR(found["diattenuation"]["median"], 0.97, 0.003);
  EXPECT_NEAR(found["gain"]["spread"], 0.02, 0.003);
  EXPECT_NEAR(found["angle_error_deg"]["spread"], 1, 0.1);
  EXPECT_NEAR(found["condition"]["median"], 1.45, 0.05);
  EXPECT_NEAR(found["residual"]["median"], 0.01, 0.001);
  EXPECT_NEAR(found["frames_condition"], std::sqrt(2), 0.02);
  // By 36 readings with noise of 1 % of light 0.8: of (a1, a2) sqrt(2 / 36) of it each, of a0 sqrt(1 / 36).
  const double a0 = 0.4, d = 0.97;
  EXPECT_NEAR(found["uncertainty"]["angle_deg"], 0.01 * std::sqrt(2 / 36.0) / (2 * a0 * d) / kRadPerDeg,
              0.02);
  EXPECT_NEAR(found["uncertainty"]["diattenuation"], 0.01 / a0 * std::sqrt((2 + d * d) / 36), 0.001);
  EXPECT_TRUE(found["doubtful_frames"].empty());
  for (const char* picture :
       {"gain.png", "condition.png", "residual.png", "angle_error.png", "condition.tif"})
    EXPECT_EQ(ReadPicture(Calibration() / picture).width(),
              std::string(picture).starts_with("condition") ? kSensorWidth / 2 : kSensorWidth);
  const Outcome show = RunPolarscan({"calibrate", "show", Calibration().string()});
  for (const char* words :
       {"vendor made up", "serial 17", "Gain 3", "dark frames: black level ", "diattenuation 0.9",
        "one pixel are known to 0.00", "flat:      not measured; polarscan calibrate flat does"})
    EXPECT_NE(show.err.find(words), std::string::npos) << words << "\n" << show.err;
}

TEST_F(Calibrate, NamesABadFrameInAWarningAndWhenItIsShown) {
  ImperfectSensor camera = Camera();
  camera.noise = 0.01;
  for (int k = 0; k < 12; ++k)  // the lamp was dimmed once
    Write("dimmed", fmt::format("turned-{:02}", k),
          camera.Take(BehindPolarizer(15 * k, k == 7 ? 0.68 : 0.8), 200 + std::uint64_t(k)));
  Describe("dimmed", "17", 12, 3);
  const Outcome outcome = Run("polarizer", "dimmed", {"--json"});
  ASSERT_EQ(outcome.exit_code, kDone) << outcome.err;
  EXPECT_NE(outcome.err.find("turned-07: it is 15.0 % darker than the others"), std::string::npos)
      << outcome.err;
  EXPECT_EQ(json::parse(outcome.out)["polarizer"]["doubtful_frames"][0]["frame"], "turned-07");
  const Outcome show = RunPolarscan({"calibrate", "show", Calibration().string()});
  EXPECT_NE(show.err.find("frames that do not fit the others: turned-07"), std::string::npos) << show.err;
}

TEST_F(Calibrate, RefusesTheCalibrationOfAnotherCameraAndOtherSettingsInWords) {
  CalibrateAll("names");
  ExpectFailure(Demosaic(OtherScene("other camera", "18", 12, 3), "views", true),
                {"not by the camera of this calibration", "serial 18 instead of 17"});
  ExpectFailure(Demosaic(OtherScene("other gain", "17", 12, 9), "views", true),
                {"other settings", "Gain 9", "instead of 3"});
  ExpectFailure(Demosaic(OtherScene("other depth", "17", 14, 3), "views", true), {"bits 14 instead of 12"});
  EXPECT_FALSE(fs::exists(folder_ / "views"));
  ExpectFailure(Run("polarizer", "other camera"), {"serial 18 instead of 17"});
}

TEST_F(Calibrate, SaysWhatIsWrongWithTheFrames) {
  ExpectFailure(Run("dark", "flat"), {"not dark"});
  ExpectFailure(Run("dark", "polarizer", {"--bits", "8"}), {"does not fit in 8 bits", "--bits"});
  ExpectFailure(Run("polarizer", "polarizer", {"--angles", "0,10,20"}), {"3 angles are given for 36 frames"});
  ExpectFailure(Run("polarizer", "polarizer", {"--angles", "0,ten"}), {"these are no angles", "FIRST:STEP"});
  ExpectFailure(Run("polarizer", "polarizer", {"--angles", "0:0"}), {"too much alike"});
  ExpectFailure(Run("polarizer", "polarizer", {"--angles", "0:6"}), {"does not fit what the frame shows"});
  ExpectFailure(Run("polarizer", "flat"), {"too much alike"});
  ExpectFailure(Run("polarizer", "dark"), {"this frame is dark"});
  ExpectFailure(Run("polarizer", "polarizer", {"--layout", "0 90 / 135 45"}), {"calibrate layout"});
  EXPECT_FALSE(fs::exists(Calibration() / "calibration.json"));
}

TEST_F(Calibrate, LayoutIsFoundFromTheTurnedPolarizer) {
  const Outcome outcome = RunPolarscan({"calibrate", "layout", Set("polarizer").string(), "--json"});
  ASSERT_EQ(outcome.exit_code, kDone) << outcome.err;
  EXPECT_EQ(json::parse(outcome.out)["layout"], "90 45 / 135 0");
  const Outcome clockwise =
      RunPolarscan({"calibrate", "layout", Set("polarizer").string(), "--json", "--sense", "clockwise"});
  EXPECT_EQ(json::parse(clockwise.out)["layout"], "90 135 / 45 0");
}

// What apply writes is as good as what demosaic makes with the calibration, and is no longer this camera's
// raw.
TEST_F(Calibrate, ApplyWritesCorrectedMosaicsThatNeedNoCalibrationAnyMore) {
  CalibrateAll("names");
  const fs::path corrected = folder_ / "corrected";
  const Outcome outcome = RunPolarscan({"calibrate", "apply", Set("scene").string(), "-o", corrected.string(),
                                        "--calibration", Calibration().string()});
  ASSERT_EQ(outcome.exit_code, kDone) << outcome.err;
  ASSERT_EQ(Demosaic(Set("scene"), "directly", true).exit_code, kDone);
  ASSERT_EQ(Demosaic(corrected, "through files", false).exit_code, kDone);
  EXPECT_NEAR(AopErrorOf("through files"), AopErrorOf("directly"), 0.003);
  ExpectFailure(Demosaic(corrected, "twice", true), {"bits 16 instead of 12"});
}

TEST_F(Calibrate, ViewsAreMadeAgainWhenTheCalibrationIsAnotherOne) {
  CalibrateAll("names");
  ASSERT_EQ(Demosaic(Set("scene"), "views", true).exit_code, kDone);
  const auto made = fs::last_write_time(folder_ / "views/0.tif");
  ASSERT_EQ(Demosaic(Set("scene"), "views", true).exit_code, kDone);
  EXPECT_EQ(fs::last_write_time(folder_ / "views/0.tif"), made);
  CalibrateAll("unknown");
  ASSERT_EQ(Demosaic(Set("scene"), "views", true).exit_code, kDone);
  EXPECT_NE(fs::last_write_time(folder_ / "views/0.tif"), made);
}

// Sessions carry camera, settings and the calibration's place.
TEST_F(Calibrate, ASessionIsCalibratedLikePictures) {
  CalibrateAll("names");
  const std::string session = (folder_ / "session").string();
  ASSERT_EQ(
      RunPolarscan({"import", Set("scene").string(), "-o", session, "--calibration", Calibration().string()})
          .exit_code,
      kDone);
  EXPECT_EQ(ReadJson(folder_ / "session/session.json")["camera"]["serial"], "17");
  ASSERT_EQ(Demosaic(session, "by session", false).exit_code, kDone);
  ASSERT_EQ(Demosaic(Set("scene"), "by option", true).exit_code, kDone);
  EXPECT_EQ(HashFile(folder_ / "by session/0.tif"), HashFile(folder_ / "by option/0.tif"));
  const std::string dark = (folder_ / "dark").string();
  ASSERT_EQ(RunPolarscan({"import", Set("dark").string(), "-o", dark}).exit_code, kDone);
  EXPECT_EQ(RunPolarscan({"calibrate", "dark", dark, "-o", Calibration().string()}).exit_code, kDone);
}

// Half of the light is too much for the long exposure, and for the short one the rest is nearly dark.
class SeveralExposures : public testing::Test {
 protected:
  static Stokes Scene(int x, int, char) {
    const double s0 = x < 32 ? 0.004 : 1.6;
    return {s0, 0.3 * s0, 0.2 * s0};
  }
  void Write(const std::string& folder, double time) const {
    ImperfectSensor camera(64, 48, 1);
    camera.truth = IdealResponses(64, 48, camera.sensor.layout);
    const Image<float> counts = camera.Take([time](int x, int y, char colour) {
      const Stokes s = Scene(x, y, colour);
      return Stokes{time * s.s0, time * s.s1, time * s.s2};
    });
    WritePng(folder_ / "input" / folder / "a.png", ToFile(counts));
    WriteJson(
        folder_ / "input/set.json",
        {{"sensor", {{"layout", "90 45 / 135 0"}, {"bits", 12}, {"black_dn", 60}, {"white_dn", 4095}}}});
  }
  Outcome Demosaic(const std::string& input) const {
    fs::remove_all(folder_ / "views");
    return RunPolarscan({"demosaic", (folder_ / input).string(), "-o", (folder_ / "views").string()});
  }
  void ExpectRight() const {
    const StokesImage view = ReadStokes(folder_ / "views/a.tif");
    for (const int x : {10, 50}) {
      EXPECT_NEAR(view.s0(x, 20) / Scene(x, 20, 'm').s0, 1, 0.01) << x;
      EXPECT_NEAR(view.s1(x, 20) / view.s0(x, 20), 0.3, 0.01) << x;
      EXPECT_NEAR(view.s2(x, 20) / view.s0(x, 20), 0.2, 0.01) << x;
      EXPECT_TRUE(std::isfinite(view.noise(x, 20)));
    }
  }
  TemporaryFolder folder_;
};

TEST_F(SeveralExposures, InFoldersByTimeAreMergedAndStayTogetherInASession) {
  Write("exposure-1000", 1), Write("exposure-100000", 100);
  const Outcome outcome = Demosaic("input");
  ASSERT_EQ(outcome.exit_code, kDone) << outcome.err;
  EXPECT_NE(outcome.err.find("several exposures"), std::string::npos) << outcome.err;
  ExpectRight();
  const std::string session = (folder_ / "session").string();
  ASSERT_EQ(RunPolarscan({"import", (folder_ / "input").string(), "-o", session}).exit_code, kDone);
  ASSERT_EQ(Demosaic("session").exit_code, kDone);
  ExpectRight();
  ASSERT_EQ(RunPolarscan({"export", session, "-o", (folder_ / "again").string()}).exit_code, kDone);
  ASSERT_EQ(Demosaic("again").exit_code, kDone);
  ExpectRight();
}

TEST_F(SeveralExposures, AFolderWithoutATimeIsAnError) {
  Write("exposure-1000", 1), Write("exposure-long", 100);
  const Outcome outcome = Demosaic("input");
  EXPECT_EQ(outcome.exit_code, kFailed);
  EXPECT_NE(outcome.err.find("exposure-500"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace polarscan::test
