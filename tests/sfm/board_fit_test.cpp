// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/board/fit_board.h"

#include "board_views.h"

namespace polarscan {
namespace {

constexpr double kMmPerWorldUnit = 60;

// Cameras of a world whose unit is 60 mm and whose axes are not the board's, and what they see of the board.
struct World {
  std::vector<BoardCamera> cameras;
  std::vector<BoardObservation> observations;
};

Similarity TrueBoardFromWorld() {
  Similarity s;
  s.scale = kMmPerWorldUnit;
  s.rotation = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  s.translation = {12, -40, 33};
  return s;
}

// pose_px: how far the poses are off, as it shows in the pictures.
World MakeWorld(std::uint64_t seed, double noise_px, double pose_px, int views = 12) {
  const Board board = StandardBoards()[0];
  const Similarity world_from_board = [] {
    const Similarity s = TrueBoardFromWorld();
    Similarity inverse{1 / s.scale, s.rotation.transpose(), {}};
    inverse.translation = -inverse.scale * (inverse.rotation * s.translation);
    return inverse;
  }();
  World world;
  Random random(seed, 9);
  const auto normal = [&](double sigma) -> Eigen::Vector3d {
    return sigma * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
  };
  for (int i = 0; i < views; ++i) {
    const Rigid seen_from = BoardCam(360.0 * i / views, i % 2 ? 35 : 55, 450);
    const BoardCamera truth{ShotLens(), world_from_board(seen_from)};
    BoardCamera camera = truth;
    const Eigen::Vector3d turn = normal(pose_px / 700);
    camera.cam_from_world.rotation =
        Eigen::AngleAxisd(turn.norm() + 1e-12, (turn + Eigen::Vector3d(1e-12, 0, 0)).normalized())
            .toRotationMatrix() *
        truth.cam_from_world.rotation;
    camera.cam_from_world.translation += normal(pose_px / 700 * truth.cam_from_world.translation.norm());
    world.cameras.push_back(camera);
    for (int corner = 0; corner < board.Corners(); ++corner) {
      if (random.Uniform() < 0.4) continue;  // hidden
      const Eigen::Vector3d on_board = board.Corner(corner);
      const Eigen::Vector2d shown = *Shown(truth, world_from_board * on_board);
      world.observations.push_back(
          {i, corner, on_board, shown + noise_px * Eigen::Vector2d(random.Normal(), random.Normal())});
    }
  }
  return world;
}

double ScaleError(const BoardFit& fit) { return fit.board_from_world.scale / kMmPerWorldUnit - 1; }

TEST(FitBoard, FindsTheTrueSimilarityWithoutNoise) {
  const World world = MakeWorld(1, 0, 0);
  const auto fit = FitBoard(world.cameras, world.observations, 2);
  ASSERT_TRUE(fit);
  const Similarity truth = TrueBoardFromWorld();
  EXPECT_NEAR(ScaleError(*fit), 0, 1e-8);
  EXPECT_LT((fit->board_from_world.rotation - truth.rotation).norm(), 1e-8);
  EXPECT_LT((fit->board_from_world.translation - truth.translation).norm(), 1e-5);
  EXPECT_EQ(fit->inliers, 1);
}

// 100 seeds: at one sigma 68 are expected, with a deviation of 4.7.
int CountCovered(double noise_px, double pose_px, int views) {
  int covered = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const World world = MakeWorld(seed, noise_px, pose_px, views);
    const auto fit = FitBoard(world.cameras, world.observations, 4);
    EXPECT_LT(std::abs(ScaleError(*fit)), 0.002);
    covered += std::abs(ScaleError(*fit)) < fit->scale_sigma;
  }
  return covered;
}

TEST(FitBoard, SigmaCoversTheTrueErrorOfNoisyCorners) {
  const int covered = CountCovered(0.15, 0, 12);
  EXPECT_GE(covered, 58);
  EXPECT_LE(covered, 84);
}

TEST(FitBoard, SigmaCoversTheTrueErrorOfPosesThatAreOff) {
  const int covered = CountCovered(0.1, 0.4, 12);
  EXPECT_GE(covered, 58);
  EXPECT_LE(covered, 84);
}

TEST(FitBoard, WrongCornersDoNoHarm) {
  World world = MakeWorld(3, 0.1, 0);
  Random random(4);
  for (BoardObservation& o : world.observations)
    if (random.Uniform() < 0.2) o.at += Eigen::Vector2d(20 * random.Uniform() + 3, -15 * random.Uniform());
  const auto fit = FitBoard(world.cameras, world.observations, 2);
  ASSERT_TRUE(fit);
  EXPECT_LT(std::abs(ScaleError(*fit)), 0.0005);
  EXPECT_NEAR(fit->inliers, 0.8, 0.05);
}

TEST(FitBoard, ABoardThatStandsStillWhileTheObjectTurnsFitsNowhere) {
  World world = MakeWorld(5, 0.1, 0);
  const World still = MakeWorld(5, 0.1, 0, 1);
  std::vector<BoardObservation> seen;
  for (int i = 0; i < 12; ++i)
    for (BoardObservation o : still.observations) {
      o.camera = i;
      seen.push_back(o);
    }
  const auto fit = FitBoard(world.cameras, seen, 2);
  EXPECT_TRUE(!fit || fit->inliers < 0.3) << fit->inliers;
}

}  // namespace
}  // namespace polarscan
