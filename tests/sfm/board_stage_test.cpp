// SPDX-License-Identifier: Apache-2.0
// Poses by the stage, with a board in the views: what it takes, and what it says where it cannot.
#include "board_views.h"
#include "fake_colmap.h"
#include "sfm_stage.h"
#include "stereo/sfm/board/length_unit.h"

namespace polarscan {
namespace {

constexpr int kBoardViews = 4;
constexpr double kMmInUnit = 60;

Rigid BoardViewPose(int view) { return BoardCam(20 + 90 * view, 60, 420); }

// Rendered once for all tests: the board as seen by each view.
const std::vector<Image<float>>& BoardShots(bool mirrored) {
  const auto make = [](bool mirror) {
    BoardShot shot;
    shot.mirrored = mirror;
    std::vector<Image<float>> shots;
    for (int i = 0; i < kBoardViews; ++i) shots.push_back(Shoot(shot, {ShotLens(), BoardViewPose(i)}));
    return shots;
  };
  static const std::vector<Image<float>> right = make(false), wrong = make(true);
  return mirrored ? wrong : right;
}

class BoardStage : public FolderTest {
 protected:
  // Poses of views 000 to 003 in units of 60 mm, the frame turned and moved.
  SparseModel Model() const {
    Similarity world_from_board;
    world_from_board.scale = 1 / kMmInUnit;
    world_from_board.rotation = Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, 1, 2).normalized()).matrix();
    world_from_board.translation = {3, -1, 2};
    SparseModel model;
    const Lens lens = ShotLens();
    const Pinhole& p = lens.pinhole;
    model.cameras[1] = {1, "SIMPLE_RADIAL", p.width, p.height, {p.fx, p.cx, p.cy, lens.k1}};
    for (int i = 0; i < kBoardViews; ++i)
      model.images[std::uint32_t(i + 1)] = {
          std::uint32_t(i + 1), 1, world_from_board(BoardViewPose(i)), "00" + std::to_string(i) + ".png", {}};
    return model;
  }
  void Write(int view, const Image<float>& s0) {
    const int w = s0.width(), h = s0.height();
    const std::string name = "00" + std::to_string(view);
    WriteStokes(folder / "views" / (name + ".tif"),
                {s0, Image<float>(w, h), Image<float>(w, h), Image<float>(w, h, 0.01f)});
    WritePng(folder / "views" / (name + ".png"), Image<std::uint8_t>(w, h, 90));
  }
  void WriteAll(bool mirrored = false) {
    for (int i = 0; i < kBoardViews; ++i) Write(i, BoardShots(mirrored)[std::size_t(i)]);
  }
  void WriteGrey(int first) {
    for (int i = first; i < kBoardViews; ++i) Write(i, Image<float>(640, 480, 0.4f));
  }
  SparseModel Run(const std::string& board = "yes") {
    WriteSparseModelText(folder / "known", Model());
    options.board = board;
    return EstimatePoses(folder / "views", folder / "sfm", folder / "known", options, progress);
  }
  std::string RunError(const std::string& board = "yes") {
    return ErrorOf([&] { Run(board); });
  }
  LengthUnit Unit() const { return UnitOfPoses(folder / "sfm"); }

  SfmOptions options;
  Listener progress;
};

void ExpectInMillimetres(const SparseModel& model, double factor = 1, double share = 0.001) {
  EXPECT_EQ(model.images.size(), std::size_t(kBoardViews));
  for (const auto& [id, image] : model.images) {
    const Eigen::Vector3d truth = factor * BoardViewPose(int(id) - 1).Center();
    EXPECT_LT((image.cam_from_world.Center() - truth).norm(), share * truth.norm());
  }
}

TEST_F(BoardStage, KnownPosesGetMillimetresAndTheBoardsFrameWhereThatIsAskedFor) {
  WriteAll();
  ExpectInMillimetres(Run());
  EXPECT_EQ(Unit().unit, "mm");
  EXPECT_EQ(Unit().source, "board");
  EXPECT_GT(Unit().sigma, 1e-6);
  EXPECT_LT(Unit().sigma, 1e-3);
  EXPECT_TRUE(progress.HeardInfo("board A4 of 25 mm squares"));
  ExpectInMillimetres(Run());  // taken as it is
  EXPECT_EQ(Unit().unit, "mm");
}

TEST_F(BoardStage, KnownPosesStayOtherwiseAndTheirUnitIsTold) {
  WriteAll();
  const SparseModel model = Run("auto");
  EXPECT_LT(
      (model.images.at(1).cam_from_world.Center() - Model().images.at(1).cam_from_world.Center()).norm(),
      1e-9);
  EXPECT_EQ(Unit().unit, "arbitrary");
  EXPECT_TRUE(progress.HeardInfo("a unit of the given poses is 60.0") ||
              progress.HeardInfo("a unit of the given poses is 59.9"));
}

TEST_F(BoardStage, EstimatedPosesTakeIt) {
  WriteAll();
  FakeColmap colmap(folder / "fake", "3.8");
  colmap.ExtractorWrites({"000.png", "001.png", "002.png", "003.png"}, 1000, kBoardViews);
  colmap.MapperWrites({Model()});
  options.colmap = colmap.program();
  options.poses_from = "features";
  ExpectInMillimetres(EstimatePoses(folder / "views", folder / "sfm", {}, options, progress));
  EXPECT_EQ(Unit().unit, "mm");
}

// Features would find poses that are a little off: the corners put them right, and the focal length.
TEST_F(BoardStage, EstimatedPosesAreMadeToFitTheCorners) {
  WriteAll();
  SparseModel off = Model();
  off.cameras.at(1).params[0] *= 1.004;
  for (auto& [id, image] : off.images)
    image.cam_from_world.translation +=
        0.004 * double(id % 2) * image.cam_from_world.translation.norm() * Eigen::Vector3d(0.3, -0.2, 1);
  FakeColmap colmap(folder / "fake", "3.8");
  colmap.ExtractorWrites({"000.png", "001.png", "002.png", "003.png"}, 1000, kBoardViews);
  colmap.MapperWrites({off});
  options.colmap = colmap.program();
  options.poses_from = "features";
  const SparseModel model = EstimatePoses(folder / "views", folder / "sfm", {}, options, progress);
  ExpectInMillimetres(model);
  EXPECT_NEAR(model.cameras.at(1).params[0], ShotLens().pinhole.fx, 0.001 * ShotLens().pinhole.fx);
}

// The lens's principal point is 2 px off the picture's middle, where it is taken to be: .3 % of the focal length.
TEST_F(BoardStage, ABoardThatAllViewsShowGivesPosesWithoutFeatures) {
  WriteAll();
  options.colmap = "/no/such/colmap";
  for (const char* from : {"auto", "board"}) {
    options.poses_from = from;
    const SparseModel model = EstimatePoses(folder / "views", folder / from, {}, options, progress);
    ExpectInMillimetres(model, 1, 0.005);
    EXPECT_NEAR(model.cameras.at(1).params[0], ShotLens().pinhole.fx, 0.004 * ShotLens().pinhole.fx);
    EXPECT_EQ(UnitOfPoses(folder / from).unit, "mm");
  }
}

TEST_F(BoardStage, WhereFeaturesFailTheBoardsViewsArePlaced) {
  WriteAll();
  WriteGrey(3);
  options.colmap = "/no/such/colmap";
  const SparseModel model = EstimatePoses(folder / "views", folder / "sfm", {}, options, progress);
  EXPECT_TRUE(progress.HeardInfo("COLMAP is not installed"));
  EXPECT_EQ(model.images.size(), std::size_t(3));
  EXPECT_TRUE(progress.Heard("fewer than eight corners of the board in 003"));
}

TEST_F(BoardStage, PosesByABoardThatIsNotThereAreRefused) {
  WriteGrey(0);
  options.poses_from = "board";
  EXPECT_TRUE(
      Contains(ErrorOf([&] { EstimatePoses(folder / "views", folder / "sfm", {}, options, progress); }),
               "poses cannot be had from a board alone"));
}

TEST_F(BoardStage, AMeasuredSquareCounts) {
  WriteAll();
  options.board_square_mm = 20;
  ExpectInMillimetres(Run("A4"), 0.8);
  EXPECT_TRUE(progress.HeardInfo("of 20 mm squares"));
}

TEST_F(BoardStage, WithoutABoardNothingIsSaidUnlessItWasAskedFor) {
  WriteGrey(0);
  Run("auto");
  EXPECT_EQ(Unit().unit, "arbitrary");
  EXPECT_TRUE(progress.warnings.empty());
  EXPECT_FALSE(ReadJson(folder / "sfm" / "model" / "result.json").contains("unit"));
  EXPECT_TRUE(Contains(RunError(), "no picture shows four markers"));
}

TEST_F(BoardStage, ABoardInOneViewIsNotEnough) {
  WriteAll();
  WriteGrey(1);
  EXPECT_TRUE(Contains(RunError(), "in view 000 only"));
  Run("auto");
  EXPECT_TRUE(progress.Heard("in view 000 only"));
}

TEST_F(BoardStage, AMirroredPrintIsNamed) {
  WriteAll(true);
  EXPECT_TRUE(Contains(RunError(), "printed mirrored"));
  Run("auto");
  EXPECT_TRUE(progress.Heard("printed mirrored"));
}

TEST_F(BoardStage, TwoBoardsAreNamed) {
  WriteAll();
  Image<float> two =
      BoardShots(false)[0];  // 640 x 480: the board in the left half, and again in the right one
  for (int y = 0; y < two.height(); ++y)
    for (int x = 0; x < two.width() / 2; ++x) {
      two(x, y) = 0;
      for (const auto& [i, j] : {std::pair(0, 0), std::pair(1, 0), std::pair(0, 1), std::pair(1, 1)})
        two(x, y) += 0.25f * BoardShots(false)[0](2 * x + i, (2 * y + j) % two.height());
      two(x + two.width() / 2, y) = two(x, y);
    }
  Write(0, two);
  EXPECT_TRUE(Contains(RunError(), "two boards A4 in 000"));
}

TEST_F(BoardStage, AnotherBoardThanTheOneAskedForIsNamed) {
  WriteAll();
  EXPECT_TRUE(Contains(RunError("A3"), "say --board A4"));
  EXPECT_TRUE(Contains(RunError("A7"), "names no board"));
}

TEST_F(BoardStage, ABoardThatStoodStillWhileTheObjectTurnedGivesNoUnit) {
  for (int i = 0; i < kBoardViews; ++i) Write(i, BoardShots(false)[0]);
  Run();
  EXPECT_TRUE(progress.Heard("does not fit the poses"));
  EXPECT_EQ(Unit().unit, "arbitrary");
}

}  // namespace
}  // namespace polarscan
