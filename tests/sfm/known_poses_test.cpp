// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/known_poses.h"

#include <cmath>
#include <functional>
#include <set>

#include "sfm_stage.h"
#include "stereo/sfm/pose_conventions.h"

namespace polarscan {
namespace {

TEST_F(Sfm, KnownPosesMatchByStemAndNeedNoColmap) {
  options.colmap = "no-such-colmap-here";
  SparseModel given = ModelOf(views, ".jpg");
  given.images[13].name = "left/002.tiff";
  given.images[99] = {99, 3, {}, "unused.jpg", {}};
  WriteSparseModelText(folder / "given", given);
  known = folder / "given";
  const SparseModel model = Run();
  ASSERT_EQ(model.images.size(), 10u);
  EXPECT_EQ(model.images.at(13).name, "002.png");
  EXPECT_LT((model.images.at(13).cam_from_world.rotation - views[2].cam_from_world.rotation).norm(), 1e-9);
}

TEST_F(Sfm, KnownPosesOfPicturesInFoldersMatchTheNamesOfTheirViews) {
  SparseModel given = Registered(0, 3);
  given.images[11].name = "cam1/0.jpg";
  given.images[12].name = "cam2/0.jpg";
  given.images[13].name = "images/cam3/0.jpg";
  given.images[14] = given.images[13];
  given.images[14].id = 14, given.images[14].name = "elsewhere.jpg";
  const auto select = [&](const std::string& name) {
    const SparseModel kept =
        SelectKnownPoses(given, {{name, 120, 100}, {"elsewhere", 120, 100}}, "the model");
    for (const auto& [id, image] : kept.images)
      if (image.name == name + ".png") return id;
    return 0u;
  };
  EXPECT_EQ(select("cam2-0"), 12u);
  EXPECT_EQ(select("cam3-0"), 13u);
  EXPECT_EQ(select("images-cam3-0"), 13u);
  EXPECT_TRUE(Contains(ErrorOf([&] { select("0"); }), "cam1/0.jpg and cam2/0.jpg"));
  given.images[13].name = "0.jpg";
  EXPECT_EQ(select("0"), 13u);
}

TEST_F(Sfm, KnownPosesOfOtherPicturesGiveExamplesOfBothNames) {
  SparseModel given = Registered(0, 2);
  given.images[11].name = "IMG_7.jpg";
  given.images[12].name = "IMG_8.jpg";
  WriteSparseModelText(folder / "given", given);
  known = folder / "given";
  const std::string message = RunError();
  EXPECT_TRUE(Contains(message, "IMG_7.jpg, IMG_8.jpg")) << message;
  EXPECT_TRUE(Contains(message, "000, 001, 002 and 7 more")) << message;
}

TEST_F(Sfm, KnownPosesScaleToThePicturesSize) {
  SparseModel given = ModelOf(views);
  given.cameras[3] = {3, "PINHOLE", 240, 200, {300, 300, 120, 100}};
  WriteSparseModelText(folder / "given", given);
  known = folder / "given";
  EXPECT_EQ(Run().cameras.at(3).params, (std::vector<double>{150, 150, 60, 50}));
  EXPECT_TRUE(progress.Heard("is for 240 x 200 pixels, the pictures have 120 x 100: it is scaled"));
  given.cameras[3].width = 300;
  WriteSparseModelText(folder / "given", given);
  EXPECT_TRUE(Contains(RunError(), "300 x 200"));
}

TEST_F(Sfm, MissingKnownPosesAreWarnedOf) {
  WriteSparseModelText(folder / "given", Registered(0, 7));
  known = folder / "given";
  EXPECT_EQ(Run().images.size(), 7u);
  EXPECT_TRUE(progress.Heard("7 of 10 views have a known pose; the model has none for 007 to 009"));
  for (const std::string& warning : progress.warnings) EXPECT_FALSE(Contains(warning, "match")) << warning;
}

TEST_F(Sfm, NamesOfKnownPosesMayLackFoldersAndExtensionsOrHaveOthers) {
  SparseModel given = ModelOf(views, "");
  given.images[12].name = "C:\\pictures\\001.jpg";
  given.images[13].name = "/home/me/002.png";
  given.images[14].name = "003.tar.gz";  // no view of ours
  WriteSparseModelText(folder / "given/0", given);
  known = folder / "given";
  EXPECT_EQ(Run().images.size(), 9u);
  EXPECT_TRUE(progress.Heard("none for 003,"));
  given.images[11].name = "right/000.png";
  given.images[15].name = "left/000.png";
  WriteSparseModelText(folder / "given/0", given);
  EXPECT_TRUE(Contains(RunError(), "the images right/000.png and left/000.png of the model are both named"));
}

TEST_F(Sfm, KnownPosesThatCannotBeAreSaid) {
  known = folder / "given";
  WriteSparseModelText(*known, Registered(0, 1));
  EXPECT_TRUE(Contains(RunError(), "only 1 of 10 views has a known pose"));
  SparseModel given = Registered(0, 10);
  for (auto& [id, image] : given.images)  // the camera's place instead of the translation's, say
    image.cam_from_world.translation = -(image.cam_from_world.rotation * Eigen::Vector3d(1, 2, 3));
  WriteSparseModelText(*known, given);
  EXPECT_TRUE(Contains(RunError(), "all cameras of the known poses stand at one place"));
  given = Registered(0, 10);
  given.cameras[3].params = {8, 8, 60, 50};  // millimetres
  WriteSparseModelText(*known, given);
  Run();
  EXPECT_TRUE(progress.Heard("Focal lengths and principal points are in pixels"));
  given.cameras[3].params = {2, 2, 60, 50};
  WriteSparseModelText(*known, given);
  EXPECT_TRUE(Contains(RunError(), "a focal length of 2 px for a picture 120 px wide"));
}

TEST_F(Sfm, PicturesOfOneKnownCameraMayDifferInSize) {
  WritePng(folder / "views/003.png", Image<std::uint8_t>(60, 50, 7));
  WriteStokes(folder / "views/003.tif", {{60, 50}, {60, 50}, {60, 50}, {}});
  WriteSparseModelText(folder / "given", ModelOf(views));
  known = folder / "given";
  const SparseModel model = Run();
  std::set<int> widths;
  for (const auto& [id, image] : model.images) {
    EXPECT_EQ(model.cameras.at(image.camera_id).width, image.name == "003.png" ? 60 : 120) << image.name;
    widths.insert(model.cameras.at(image.camera_id).width);
  }
  EXPECT_EQ(widths.size(), 2u);
  EXPECT_TRUE(progress.Heard("is for 120 x 100 pixels, the pictures have 60 x 50"));
}

TEST_F(Sfm, OnePictureWithKnownPosesIsSaidToBeTooFew) {
  known = folder / "given";
  WriteSparseModelText(*known, Registered(0, 1));
  const std::string error = ErrorOf([&] { ReadKnownPoses(*known, {{views[0].name, 120, 100}}, progress); });
  EXPECT_TRUE(Contains(error, "there is one picture only, 000")) << error;
}

// A ring of cameras that look at its middle, from different distances, its numbers written as `write` does.
SparseModel Written(const std::function<void(Rigid&)>& write) {
  SparseModel model;
  for (int i = 0; i < 9; ++i) {
    const double angle = 0.5 * i, far = 4 + 0.3 * (i % 3);
    const Eigen::Vector3d place(far * std::sin(angle), 1 + 0.2 * (i % 2), far * std::cos(angle));
    Rigid pose;
    const Eigen::Vector3d z = -place.normalized(), x = Eigen::Vector3d(0, -1, 0).cross(z).normalized();
    pose.rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
    pose.translation = -(pose.rotation * place);
    write(pose);
    model.images[std::uint32_t(i)] = {std::uint32_t(i), 1, pose, "", {}};
  }
  return model;
}

TEST(PoseReadings, PosesOfAnotherConventionAreFoundOutAndRightOnesAreNot) {
  const auto to_world = [](Rigid& pose) { pose = pose.Inverse(); };
  const auto axes = [](Rigid& pose) {
    const Eigen::Matrix3d turn = Eigen::Vector3d(1, -1, -1).asDiagonal();
    pose = {turn * pose.rotation, turn * pose.translation};
  };
  EXPECT_EQ(OtherConvention(Written([](Rigid&) {})), "");
  EXPECT_TRUE(
      Contains(OtherConvention(Written(to_world)), "with the poses as those of the camera in the world"));
  EXPECT_TRUE(Contains(OtherConvention(Written(axes)), "with the cameras' axes as y up"));
  const std::string both = OtherConvention(Written([&](Rigid& pose) { axes(pose), to_world(pose); }));
  EXPECT_TRUE(Contains(both, "in the world (camera to world) and the cameras' axes as y up")) << both;
  SparseModel moved = Written(to_world);  // in a local frame
  moved.offset = {1, 2, 3};
  for (auto& [id, image] : moved.images)
    image.cam_from_world.translation += image.cam_from_world.rotation * moved.offset;
  EXPECT_EQ(OtherConvention(moved), OtherConvention(Written(to_world)));
}

TEST(PoseReadings, FlightsAndRoomsAreNotDoubted) {
  const SparseModel flight = Written([](Rigid& pose) {  // straight down
    const Eigen::Vector3d place = pose.Center();
    pose.rotation = Eigen::Vector3d(1, -1, -1).asDiagonal();
    pose.translation = -(pose.rotation * place);
  });
  EXPECT_EQ(OtherConvention(flight), "");
  SparseModel room = Written([](Rigid& pose) {  // looks outward
    const Eigen::Matrix3d turn = Eigen::Vector3d(-1, 1, -1).asDiagonal();
    pose = {turn * pose.rotation, turn * pose.translation};
  });
  room.points[1] = {};  // found in its pictures
  EXPECT_EQ(OtherConvention(room), "");
}

}  // namespace
}  // namespace polarscan
