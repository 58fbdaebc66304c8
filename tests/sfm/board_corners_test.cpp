// SPDX-License-Identifier: Apache-2.0
#include "board/corners.h"

#include "board_views.h"

namespace polarscan {
namespace {

// Misses of the corners that are found in a shot, px, sorted.
struct Found {
  std::vector<double> misses;
  double Rms() const {
    double sum = 0;
    for (const double miss : misses) sum += miss * miss;
    return std::sqrt(sum / double(std::max<std::size_t>(1, misses.size())));
  }
};

Found FindIn(const BoardShot& shot, const Rigid& cam_from_board) {
  const BoardCamera camera{ShotLens(), cam_from_board};
  const Image<float> s0 = Shoot(shot, camera);
  Found found;
  for (const SeenCorner& corner : FindBoardCorners(s0, SeeMarkers(s0), shot.board))
    found.misses.push_back((*Shown(camera, shot.board.Corner(corner.corner)) - corner.at).norm());
  std::ranges::sort(found.misses);
  return found;
}

TEST(BoardCorners, AreFoundToATenthOfAPixel) {
  for (const auto& [turn, elevation, distance] :
       {std::tuple(20, 75, 420.0), std::tuple(110, 50, 420.0), std::tuple(250, 35, 400.0)}) {
    const Found found = FindIn({}, BoardCam(turn, elevation, distance));
    EXPECT_GT(found.misses.size(), 35u) << elevation;
    EXPECT_LT(found.Rms(), 0.1) << elevation;
    EXPECT_LT(found.misses.back(), 0.5) << elevation;
  }
}

TEST(BoardCorners, AreFoundInBlurredAndNoisyPictures) {
  BoardShot shot;
  shot.blur_px = 1.6, shot.noise = 0.02;
  const Found found = FindIn(shot, BoardCam(110, 55, 380));
  EXPECT_GT(found.misses.size(), 20u);
  EXPECT_LT(found.Rms(), 0.25) << "blur of 1.6 px, noise of 1 in 50";
}

TEST(BoardCorners, AreFoundWhereHalfOfTheBoardIsHidden) {
  BoardShot shot;
  shot.hidden = [](double x, double y) { return std::hypot(x - 15, y - 20) < 75; };
  const Found found = FindIn(shot, BoardCam(110, 50, 420));
  EXPECT_GT(found.misses.size(), 12u);
  EXPECT_LT(found.Rms(), 0.1) << "the edge of what hides the board makes no corners";
}

TEST(BoardCorners, OfTheA3BoardAreNotTakenForThoseOfTheA4Board) {
  BoardShot shot;
  shot.board = StandardBoards()[1];
  const BoardCamera camera{ShotLens(), BoardCam(10, 70, 560)};
  const Image<float> s0 = Shoot(shot, camera);
  const MarkersSeen seen = SeeMarkers(s0);
  EXPECT_GT(seen.markers.size(), 30u);
  EXPECT_TRUE(FindBoardCorners(s0, seen, StandardBoards()[0]).empty());
}

TEST(BoardCorners, MarkersOfAMirroredPrintAreSeenInTheMirrorOnly) {
  BoardShot shot;
  shot.mirrored = true;
  const Image<float> s0 = Shoot(shot, {ShotLens(), BoardCam(10, 70, 420)});
  EXPECT_LT(SeeMarkers(s0).markers.size(), 4u);
  EXPECT_GT(SeeMarkers(s0, true).markers.size(), 20u);
}

}  // namespace
}  // namespace polarscan
