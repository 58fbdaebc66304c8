// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/board/poses_by_board.h"

#include "board_views.h"
#include "stereo/sfm/board/adjust_with_board.h"
#include "stereo/sfm/board/board_scale.h"

namespace polarscan {
namespace {

constexpr int kRingViews = 12;

struct Sights {
  std::vector<ListedView> views;
  BoardSightings sightings;
  std::vector<Rigid> poses;
};

// A lens with barrel distortion that is centred, as SIMPLE_RADIAL takes it to be.
Lens CentredLens() { return {{640, 480, 700, 700, 320, 240}, -0.08, 0, 0, 0}; }

// What 12 views see of the board: corners at noise_px, two fifths of them hidden.
Sights MakeSights(std::uint64_t seed, double noise_px) {
  Sights made;
  made.sightings.board = StandardBoards()[0];
  Random random(seed, 21);
  for (int i = 0; i < kRingViews; ++i) {
    const std::string name = "v" + std::to_string(100 + i);
    const BoardCamera camera{CentredLens(), BoardCam(360.0 * i / kRingViews, i % 2 ? 35 : 55, 450)};
    made.views.push_back({name, 640, 480});
    made.poses.push_back(camera.cam_from_world);
    BoardSighting sighting{name, {}};
    for (int corner = 0; corner < made.sightings.board->Corners(); ++corner) {
      if (random.Uniform() < 0.4) continue;
      const Eigen::Vector2d noise(random.Normal(), random.Normal());
      sighting.corners.push_back(
          {corner, *Shown(camera, made.sightings.board->Corner(corner)) + noise_px * noise});
    }
    made.sightings.views.push_back(std::move(sighting));
  }
  return made;
}

double MeanDistance(const SparseModel& model) {
  double sum = 0;
  for (const auto& [id, image] : model.images) sum += image.cam_from_world.Center().norm();
  return sum / double(model.images.size());
}

TEST(PosesByBoardAlone, AreExactWithoutNoise) {
  const Sights sights = MakeSights(1, 0);
  const auto model = PosesByBoard(sights.views, sights.sightings, {}, Progress());
  ASSERT_TRUE(model);
  ASSERT_EQ(model->images.size(), std::size_t(kRingViews));
  EXPECT_NEAR(model->cameras.at(1).params[0], 700, 0.01);
  EXPECT_NEAR(model->cameras.at(1).params[3], -0.08, 1e-4);
  for (const auto& [id, image] : model->images)
    EXPECT_LT((image.cam_from_world.Center() - sights.poses[id - 1].Center()).norm(), 0.01);
}

TEST(PosesByBoardAlone, AllLensModelsAreSupported) {
  const Sights sights = MakeSights(2, 0.05);
  for (const char* lens : {"SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV"}) {
    SfmOptions options;
    options.camera_model = lens;
    const auto model = PosesByBoard(sights.views, sights.sightings, options, Progress());
    ASSERT_TRUE(model) << lens;
    EXPECT_EQ(model->cameras.at(1).model, lens);
    const bool straight = std::string(lens).ends_with("PINHOLE");  // the lens is not
    EXPECT_NEAR(ToLens(model->cameras.at(1)).pinhole.fx, 700, straight ? 40 : 1) << lens;
  }
}

// One view shows the board of another picture: it is left out.
TEST(PosesByBoardAlone, AViewThatDoesNotBelongIsLeftOut) {
  Sights sights = MakeSights(3, 0.1);
  Random random(3, 22);
  for (SeenCorner& corner : sights.sightings.views[4].corners)
    corner.at += 15 * Eigen::Vector2d(random.Normal(), random.Normal());
  const auto model = PosesByBoard(sights.views, sights.sightings, {}, Progress());
  ASSERT_TRUE(model);
  EXPECT_EQ(model->images.size(), std::size_t(kRingViews - 1));
  EXPECT_NEAR(model->cameras.at(1).params[0], 700, 1);
}

TEST(PosesByBoardAlone, NoneWhereTooLittleIsSeen) {
  Sights sights = MakeSights(4, 0.1);
  sights.sightings.views.resize(2);
  EXPECT_FALSE(PosesByBoard(sights.views, sights.sightings, {}, Progress()));
  sights = MakeSights(4, 0.1);
  sights.views[3].width = 800;
  EXPECT_FALSE(PosesByBoard(sights.views, sights.sightings, {}, Progress()));
  sights = MakeSights(4, 0.1);
  for (BoardSighting& view : sights.sightings.views) view.corners.resize(5);
  EXPECT_FALSE(PosesByBoard(sights.views, sights.sightings, {}, Progress()));
}

// Of 60 seeds at least 39 (65 %) as one sigma should, and not nearly all of them as one that is much too large would.
TEST(PosesByBoardAlone, TheUnitsUncertaintyCoversTheError) {
  constexpr int kSeeds = 60;
  int covered = 0;
  double worst = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const Sights sights = MakeSights(std::uint64_t(seed), 0.1);
    auto model = PosesByBoard(sights.views, sights.sightings, {}, Progress());
    ASSERT_TRUE(model);
    Progress progress;
    const LengthUnit unit = TakeUnitOfBoard(*model, sights.sightings, BoardUse::kAdjust, progress);
    const double error = std::abs(MeanDistance(*model) / 450 - 1);
    covered += error < unit.sigma;
    worst = std::max(worst, error);
  }
  EXPECT_GE(covered, 39);
  EXPECT_LE(covered, 57);
  EXPECT_LT(worst, 0.003);
}

}  // namespace
}  // namespace polarscan
