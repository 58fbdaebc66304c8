// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <fstream>
#include <thread>

#include "pipeline/stereo/stereo.h"
#include "tests/polarpms/sphere_views.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

TEST_F(Sphere, ADamagedCorrectionIsNamed) {
  Write(true);
  CreateFolder(folder_ / "stereo");
  WriteFileAtomically(folder_ / "stereo/polarization.json", "{\"turn_deg\": 1}");
  try {
    ReadWorkspace(folder_);
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_NE(e.where().find("polarization.json"), std::string::npos) << e.what();
  }
}

TEST_F(Sphere, OneAndTwoThreadsGiveTheSameBytes) {
  Write(true);
  for (const char* preset : {"default", "paper", "acmmp", "polarimetric-mvs"}) {
    StereoOptions options = Quick(preset);
    options.continuous_iterations = 2;
    std::string bytes[2];
    for (int threads : {1, 2}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
      fs::remove_all(folder_ / "stereo");
      EstimateMaps(folder_, options, progress_);
      bytes[threads - 1] = AllBytes();
    }
    EXPECT_TRUE(bytes[0] == bytes[1]) << preset;
  }
}

TEST_F(Sphere, GoesOnAfterACancelAndRepairsADamagedMap) {
  Write(true);
  EstimateMaps(folder_, Quick("default"), progress_);
  const std::string undisturbed = AllBytes();
  fs::remove_all(folder_ / "stereo");
  struct StopAtThirdView : Progress {
    void Advance(std::size_t) override {
      if (++views == 3) Cancel();
    }
    int views = 0;
  } stop;
  EXPECT_THROW(EstimateMaps(folder_, Quick("default"), stop), Cancelled);
  EXPECT_TRUE(fs::exists(workspace_.DepthPath(2, MapKind{MapStage::kStep, 0})));
  EXPECT_FALSE(fs::exists(workspace_.DepthPath(4, MapKind{MapStage::kStep, 0})));
  std::ofstream(workspace_.DepthPath(1, MapKind{MapStage::kStep, 0}), std::ios::trunc) << "damage";
  std::ofstream(workspace_.NormalPath(1, MapKind{MapStage::kStep, 77})) << "of other options, killed";
  EstimateMaps(folder_, Quick("default"), progress_);
  EXPECT_TRUE(AllBytes() == undisturbed);
  EXPECT_FALSE(fs::exists(workspace_.DepthPath(1, MapKind{MapStage::kStep, 0}))) << "left over";
  EXPECT_FALSE(fs::exists(workspace_.NormalPath(1, MapKind{MapStage::kStep, 77}))) << "left over";
  std::ofstream(workspace_.NormalPath(1, kFinalMaps), std::ios::trunc) << "damage";
  EstimateMaps(folder_, Quick("default"), progress_);
  EXPECT_TRUE(AllBytes() == undisturbed);
}

TEST_F(Sphere, PolarimetricMvsGoesOnAfterACancelAndItsFilterKeepsWhatContoursReached) {
  Write(true);
  StereoOptions options = Quick("polarimetric-mvs");
  EstimateMaps(folder_, options, progress_);
  const std::string undisturbed = AllBytes();
  fs::remove_all(folder_ / "stereo");
  struct StopInPropagation : Progress {
    void Advance(std::size_t) override {
      if (++views == 2 * kViews + 3) Cancel();
    }
    int views = 0;
  } stop;
  EXPECT_THROW(EstimateMaps(folder_, options, stop), Cancelled);
  EXPECT_TRUE(fs::exists(workspace_.DepthPath(2, kFinalMaps)));
  EXPECT_FALSE(fs::exists(workspace_.DepthPath(4, kFinalMaps)));
  EstimateMaps(folder_, options, progress_);
  EXPECT_TRUE(AllBytes() == undisturbed);
  EXPECT_FALSE(fs::exists(workspace_.DepthPath(1, MapKind{MapStage::kStep, 1}))) << "left over";
  options.filter = true;
  EstimateMaps(folder_, options, progress_);
  EXPECT_GT(Compare().estimated, 0.8);
  options.filter_min_variance = 65025;  // no point has so much texture
  EstimateMaps(folder_, options, progress_);
  EXPECT_EQ(Compare().estimated, 0);
}

TEST_F(Sphere, ShardsMakeTheSameBytesAsOneProgram) {
  for (const char* preset : {"default", "paper", "acmmp", "polarimetric-mvs"}) {
    Write(true);
    EstimateMaps(folder_, Quick(preset), progress_);
    const std::string alone = AllBytes();
    fs::remove_all(folder_ / "stereo");
    std::vector<std::jthread> shards;
    for (int i : {1, 0, 2})
      shards.emplace_back([&, i] {
        Progress progress;
        EstimateMaps(folder_, Quick(preset), progress, {i, 3, 60});
      });
    shards.clear();
    EXPECT_TRUE(AllBytes() == alone) << preset;
    const auto made = fs::last_write_time(workspace_.DepthPath(0, kFinalMaps));
    EstimateMaps(folder_, Quick(preset), progress_);  // finds everything done
    EXPECT_EQ(fs::last_write_time(workspace_.DepthPath(0, kFinalMaps)), made);
    EXPECT_TRUE(AllBytes() == alone) << preset;
  }
}

TEST_F(Sphere, AShardWithoutTheOthersSaysWhatIsMissing) {
  Write(true);
  try {
    EstimateMaps(folder_, Quick("fast"), progress_, {0, 2, 0.3});
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("Start all shards"), std::string::npos) << e.what();
  }
}

TEST_F(Sphere, AViewWithoutSourcesIsNamed) {
  Write(true);
  workspace_.views[3].sources.clear();
  WriteWorkspace(workspace_);
  try {
    EstimateMaps(folder_, Quick("default"), progress_);
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("v3"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace polarscan
