// SPDX-License-Identifier: Apache-2.0
// Cameras without hardware, the capture loop over them, and sessions as input.
#include "acquisition/camera/camera.h"

#include <cmath>

#include "acquisition/capture.h"
#include "acquisition/input/input.h"
#include "acquisition/session/import_export.h"
#include "acquisition/session/session_views.h"
#include "core/error.h"
#include "demosaic/polar_view.h"
#include "session_helpers.h"
#include "simulation/cameras.h"
#include "simulation/simulator.h"

namespace polarscan::test {
namespace {

namespace fs = std::filesystem;

std::unique_ptr<Camera> SmallCamera(const std::string& format = "Mono12p", const std::string& fps = "1000") {
  std::unique_ptr<Camera> camera = OpenAnyCamera("simulated", 1);
  const std::pair<const char*, std::string> features[] = {
      {"width", "64"},     {"height", "48"},         {"rings", "33:3"},
      {"samples", "1"},    {"scene", "sphere"},      {"table", "false"},
      {"blocks", "false"}, {"pixel-format", format}, {"fps", fps}};
  for (const auto& [name, value] : features) camera->Set(name, value);
  return camera;
}

class CameraTest : public SessionFolder {
 protected:
  CaptureStatus Record(Camera& camera, const CaptureOptions& options, const std::string& name = "session") {
    return Capture(camera, folder_ / name, nlohmann::json::object(), options, {}, silent_);
  }
  Session Open(const std::string& name = "session") { return OpenSession(folder_ / name, Verify::kPayloads); }
  Progress silent_;
};

TEST_F(CameraTest, TheSimulatedCameraIsRecordedWithItsSensorAndSettings) {
  const auto camera = SmallCamera();
  const CaptureStatus status = Record(*camera, {.frames = 7});
  EXPECT_EQ(status.counts.stored, 7u);
  const Session session = Open();
  ASSERT_EQ(session.frames.size(), 7u);
  EXPECT_TRUE(session.info.closed);
  EXPECT_EQ(session.info.sensor["layout"], "90 45 / 135 0");
  EXPECT_EQ(session.info.sensor["bits"], 12);
  EXPECT_EQ(session.info.settings["width"], 64);
  EXPECT_EQ(session.info.settings["pixel-format"], "Mono12p");
  EXPECT_EQ(session.frames[0].bytes, 64u * 48 * 3 / 2);
}

TEST_F(CameraTest, FramesOfOnePlaceDifferOnlyByTheSensorsNoise) {
  const auto camera = SmallCamera("Mono12");
  Record(*camera, {.frames = 6});  // places 0 1 2 0 1 2
  const Session session = Open();
  const auto first = Counts(ReadFrame(session, 0)), second = Counts(ReadFrame(session, 3));
  const SimulatedSensor sensor;
  double sum = 0, expected = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    const double a = first.pixels()[i], b = second.pixels()[i], mean = (a + b) / 2 - sensor.black_dn();
    sum += (a - b) * (a - b);
    const double variance =
        sensor.dn_per_e() * std::max(0.0, mean) + std::pow(sensor.dn_per_e() * sensor.read_noise_e, 2);
    expected += 2 * (variance + 1.0 / 12);
  }
  EXPECT_NEAR(sum / expected, 1, 0.1);  // 3072 pixels: 2.6 % of standard deviation
}

TEST_F(CameraTest, AReplayGivesTheSamePayloadsAndTheSameGaps) {
  const auto camera = SmallCamera("Mono12Packed");
  camera->Set("frame-loss", "0.3");
  Record(*camera, {.frames = 20});
  const Session recorded = Open();
  EXPECT_GT(recorded.info.counts.lost, 0u);
  const auto replay = OpenAnyCamera("replay:" + session().string());
  replay->Set("speed", "0");
  EXPECT_EQ(Record(*replay, {}, "again").counts.stored, 20u);
  const Session again = Open("again");
  ASSERT_EQ(again.frames.size(), 20u);
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(again.frames[i].info.sequence, recorded.frames[i].info.sequence);
    EXPECT_EQ(ReadFrame(again, i).payload, ReadFrame(recorded, i).payload);
  }
  EXPECT_EQ(again.info.counts.reasons, recorded.info.counts.reasons);
  EXPECT_EQ(again.info.sensor, recorded.info.sensor);
}

TEST_F(CameraTest, FramesThatNeverCameAreCountedAndNothingElseIsMissing) {
  const auto camera = SmallCamera();
  camera->Set("frame-loss", "0.5");
  const FrameCounts counts = Record(*camera, {.frames = 40}).counts;
  EXPECT_EQ(counts.stored, 40u);
  EXPECT_GT(counts.lost, 10u);
  EXPECT_EQ(counts.dropped, 0u);
  const Session session = Open();
  EXPECT_EQ(session.frames.back().info.sequence - session.frames.front().info.sequence + 1, counts.total());
}

TEST_F(CameraTest, OneShotInAWhileLeavesTheOtherFramesOutAndCountsThem) {
  const auto camera = SmallCamera("Mono8", "200");
  const CaptureStatus status = Record(*camera, {.frames = 6, .every_s = 0.1, .shot_frames = 2});
  EXPECT_EQ(status.counts.stored, 6u);
  EXPECT_GT(status.counts.cancelled, 10u);
  EXPECT_EQ(status.counts.lost, 0u);
  const std::vector<SessionView> views = ViewsOf(Open());
  ASSERT_EQ(views.size(), 3u);
  for (const SessionView& view : views) EXPECT_EQ(view.frames.size(), 2u);
}

TEST_F(CameraTest, ALostFrameShiftsNoOtherIntoAnotherShot) {
  const auto camera = SmallCamera("Mono8", "500");
  camera->Set("frame-loss", "0.3");
  Record(*camera, {.frames = 30, .shot_frames = 4});
  for (const StoredFrame& frame : Open().frames) EXPECT_EQ(frame.info.shot, frame.info.sequence / 4);
}

TEST_F(CameraTest, AShotIsTakenOnAKeyAndTheLastKeyEnds) {
  const auto camera = SmallCamera("Mono8", "200");
  int keys = 0;
  CaptureHooks hooks;
  hooks.key = [&] {
    ++keys;
    return keys == 5 || keys == 10 ? CaptureHooks::Key::kShot
           : keys == 20            ? CaptureHooks::Key::kQuit
                                   : CaptureHooks::Key::kNone;
  };
  const CaptureOptions options{.on_key = true, .shot_frames = 3};
  Capture(*camera, session(), nlohmann::json::object(), options, hooks, silent_);
  const std::vector<SessionView> views = ViewsOf(Open());
  ASSERT_EQ(views.size(), 2u);
  EXPECT_EQ(views[0].frames.size(), 3u);
}

TEST_F(CameraTest, ATriggeredCameraTakesNoFrameThatNobodyWants) {
  const auto camera = SmallCamera("Mono8", "200");
  const CaptureStatus status =
      Record(*camera, {.frames = 6, .every_s = 0.1, .trigger = true, .shot_frames = 2});
  EXPECT_EQ(status.counts.stored, 6u);
  EXPECT_EQ(status.counts.total(), 6u);
  EXPECT_EQ(Open().frames.back().info.sequence, 5u);
  const auto replay = OpenAnyCamera("replay:" + session().string());
  EXPECT_THROW(replay->UseSoftwareTrigger(), Error);
}

TEST_F(CameraTest, CancellingEndsTheSessionInOrder) {
  const auto camera = SmallCamera("Mono8", "100");
  CaptureHooks hooks;
  hooks.status = [&](const CaptureStatus& status) {
    if (status.counts.stored > 0) silent_.Cancel();
  };
  const CaptureStatus status = Capture(*camera, session(), nlohmann::json::object(), {}, hooks, silent_);
  EXPECT_GT(status.counts.stored, 0u);
  EXPECT_EQ(status.counts.pending, 0u);
  EXPECT_TRUE(Open().info.closed);
  EXPECT_EQ(Open().frames.size(), status.counts.stored);
}

TEST_F(CameraTest, ASessionIsAnInputWithOneViewAShotThatIsTheMedianOfItsFrames) {
  const auto camera = SmallCamera("Mono12p");
  camera->Set("hold", "3");
  Record(*camera, {.frames = 9, .shot_frames = 3});
  const Input input = OpenInput(session(), {});
  EXPECT_EQ(input.kind, InputKind::kMosaic);
  ASSERT_EQ(input.views.size(), 3u);
  EXPECT_EQ(input.views[2].name, "000002");
  EXPECT_EQ(input.sensor.bits, 12);
  EXPECT_EQ(input.sensor.layout, ParseLayout("90 45 / 135 0"));
  EXPECT_EQ(input.sensor.white_dn, 4000);
  const LoadedView view = ReadView(input, 1);
  const Session session = Open();
  const auto a = Counts(ReadFrame(session, 3)), b = Counts(ReadFrame(session, 4)),
             c = Counts(ReadFrame(session, 5));
  for (std::size_t i = 0; i < a.size(); ++i) {
    const auto x = a.pixels()[i], y = b.pixels()[i], z = c.pixels()[i];
    ASSERT_EQ(view.pictures[0].planes[0].pixels()[i],
              float(std::max(std::min(x, y), std::min(std::max(x, y), z))));
  }
}

TEST_F(CameraTest, ExportedMosaicsAndTheirImportHoldTheSameCounts) {
  const auto camera = SmallCamera("Mono10p");
  Record(*camera, {.frames = 3});
  for (const char* extension : {"tif", "png"}) {
    const fs::path pictures = folder_ / extension, back = folder_ / (std::string(extension) + "-session");
    EXPECT_EQ(ExportSession(Open(), pictures, extension, silent_), 3u);
    const Input input = OpenInput(pictures, {});
    EXPECT_EQ(input.sensor.bits, 10);
    EXPECT_EQ(ImportSession(input, back, silent_), 3u);
    const Session imported = OpenSession(back, Verify::kPayloads), recorded = Open();
    ASSERT_EQ(imported.frames.size(), 3u);
    EXPECT_EQ(imported.frames[0].info.pixel_format, "Mono10");
    EXPECT_EQ(imported.frames[1].info.name, "000001");
    for (std::size_t i = 0; i < 3; ++i) {
      const auto a = Counts(ReadFrame(imported, i)), b = Counts(ReadFrame(recorded, i));
      EXPECT_TRUE(std::ranges::equal(a.pixels(), b.pixels()));
    }
    EXPECT_EQ(Meaning(OpenInput(back, {})), Meaning(OpenInput(session(), {})));
  }
}

// Four pictures give the Stokes vectors that the mosaic gives, but for their rounding.
TEST_F(CameraTest, PicturesByAngleAreAnInputWithTheSamePolarization) {
  Record(*SmallCamera(), {.frames = 1});
  const Input mosaics = OpenInput(session(), {});
  const DemosaicMethod& method = FindDemosaicMethod("bilinear");
  ASSERT_EQ(ExportAngles(mosaics, method, folder_ / "angles", "png", silent_), 1u);
  const Input angles = OpenInput(folder_ / "angles", {});
  ASSERT_EQ(angles.kind, InputKind::kAngles);
  const LoadedView raw = ReadView(mosaics, 0), by_angle = ReadView(angles, 0);
  const StokesImage a = ViewFromMosaic(raw.pictures[0].planes[0], mosaics.sensor, method).stokes;
  const StokesImage b = ViewFromAngles({&by_angle.pictures[0], &by_angle.pictures[1], &by_angle.pictures[2],
                                        &by_angle.pictures[3]},
                                       angles.sensor)
                            .stokes;
  std::size_t valid = 0;
  for (std::size_t i = 0; i < a.s0.size(); ++i) {
    const bool beyond = std::ranges::any_of(by_angle.pictures, [&](const Picture& picture) {
      return picture.planes[0].pixels()[i] >= 65535;  // recovered above full scale: no room in a picture
    });
    if (!std::isfinite(a.noise.pixels()[i]) || beyond) continue;
    ++valid;
    ASSERT_NEAR(a.s0.pixels()[i], b.s0.pixels()[i], 4e-5);
    ASSERT_NEAR(a.s1.pixels()[i], b.s1.pixels()[i], 4e-5);
    ASSERT_NEAR(a.s2.pixels()[i], b.s2.pixels()[i], 4e-5);
  }
  EXPECT_GT(valid, a.s0.size() / 2);
}

TEST_F(CameraTest, WrongCamerasAndFeaturesAreErrorsThatNameThem) {
  EXPECT_THROW(OpenAnyCamera("nikon"), Error);
  EXPECT_THROW(OpenAnyCamera("replay:" + (folder_ / "nowhere").string()), Error);
  const auto camera = SmallCamera();
  EXPECT_THROW(camera->Set("iso", "100"), Error);
  EXPECT_THROW(camera->Set("fps", "fast"), Error);
  EXPECT_THROW(camera->Set("fps", "-1"), Error);
  camera->Set("pixel-format", "RGB8");
  EXPECT_THROW(Record(*camera, {.frames = 1}), Error);
  EXPECT_FALSE(fs::exists(session()));
}

}  // namespace
}  // namespace polarscan::test
