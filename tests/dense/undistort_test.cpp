// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/undistort.h"

#include "tests/sfm/helpers.h"

namespace polarscan {
namespace {

class UndistortStage : public FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    WriteViews(folder / "views", views);
  }
  Workspace Run(const SparseModel& model, const UndistortOptions& options = {}) {
    Undistort(folder / "views", model, folder / "dense", options, progress);
    return ReadWorkspace(folder / "dense");
  }
  std::vector<DenseView> views = Ring(6);
  Listener progress;
};

TEST_F(UndistortStage, StraightViewsPassBitForBit) {
  const Workspace workspace = Run(ModelOf(views));
  ASSERT_EQ(workspace.views.size(), 6u);
  EXPECT_TRUE(workspace.polarized);
  for (int i = 0; i < 6; ++i) {
    const std::string name = workspace.views[std::size_t(i)].name;
    EXPECT_EQ(ReadFile(workspace.StokesPath(i)), ReadFile(folder / "views" / (name + ".tif")));
    EXPECT_EQ(ReadFile(workspace.PicturePath(i)), ReadFile(folder / "views" / (name + ".png")));
    EXPECT_EQ(workspace.views[std::size_t(i)].camera.cx, 60);  // ours; only the exported one is shifted
    EXPECT_FALSE(workspace.views[std::size_t(i)].sources.empty());
  }
  const SparseModel sparse = ReadSparseModel(folder / "dense/sparse");
  EXPECT_EQ(sparse.cameras.begin()->second.params, (std::vector<double>{150, 150, 59.5, 49.5}));
}

TEST_F(UndistortStage, ViewsWithoutAPoseAreLeftOutAndOldFilesGo) {
  Run(ModelOf(views));
  SparseModel model = ModelOf(views);
  model.images.erase(13);
  const Workspace workspace = Run(model);
  EXPECT_EQ(workspace.views.size(), 5u);
  EXPECT_EQ(workspace.views[2].name, "003");
  EXPECT_FALSE(std::filesystem::exists(folder / "dense/polar/002.tif"));
  EXPECT_FALSE(std::filesystem::exists(folder / "dense/images/002.png"));
}

TEST_F(UndistortStage, HalfSizeHalvesCamerasAndFiles) {
  UndistortOptions options;
  options.max_image_size = 60;
  const Workspace workspace = Run(ModelOf(views), options);
  EXPECT_EQ(workspace.views[0].camera.width, 60);
  EXPECT_EQ(workspace.views[0].camera.height, 50);
  EXPECT_EQ(workspace.views[0].camera.fx, 75);
  const StokesImage stokes = ReadStokes(workspace.StokesPath(0));
  EXPECT_EQ(stokes.s0.width(), 60);
  EXPECT_NEAR(stokes.s0(10, 10), 0.5 + 0.001 * 20.5, 1e-6);
  EXPECT_NEAR(stokes.noise(10, 10), 0.005, 1e-6);
  EXPECT_EQ(ReadPicture(workspace.PicturePath(0)).width(), 60);
}

TEST_F(UndistortStage, PlainPhotosAreNotPolarized) {
  for (const DenseView& view : views) {
    StokesImage stokes = ReadStokes(folder / "views" / (view.name + ".tif"));
    for (std::size_t i = 0; i < stokes.s1.size(); ++i) stokes.s1.pixels()[i] = stokes.s2.pixels()[i] = 0;
    WriteStokes(folder / "views" / (view.name + ".tif"), stokes);
  }
  EXPECT_FALSE(Run(ModelOf(views)).polarized);
}

TEST_F(UndistortStage, MasksComeAlongUnlessSwitchedOff) {
  for (const DenseView& view : views) {
    Image<std::uint8_t> mask(120, 100);
    for (int y = 40; y < 60; ++y)
      for (int x = 50; x < 70; ++x) mask(x, y) = 255;
    WritePng(folder / "views/masks" / (view.name + ".png"), mask);
  }
  Workspace workspace = Run(ModelOf(views));
  EXPECT_EQ(ReadViewMask(workspace, 0)(60, 50), 255);
  EXPECT_EQ(ReadViewMask(workspace, 0)(10, 50), 0);
  const double masked = workspace.views[0].depth_max - workspace.views[0].depth_min;
  UndistortOptions options;
  options.masks = false;
  workspace = Run(ModelOf(views), options);
  EXPECT_TRUE(ReadViewMask(workspace, 0).empty());
  EXPECT_GT(workspace.views[0].depth_max - workspace.views[0].depth_min, 2 * masked);
}

TEST_F(UndistortStage, GivenDepthsAreTaken) {
  UndistortOptions options;
  options.depth_min = 3;
  options.depth_max = 5;
  const Workspace workspace = Run(ModelOf(views), options);
  EXPECT_EQ(workspace.views[3].depth_min, 3);
  EXPECT_EQ(workspace.views[3].depth_max, 5);
  options.depth_max = 2;
  EXPECT_THROW(Run(ModelOf(views), options), Error);
}

TEST_F(UndistortStage, BadViewsAreNamedAndLeaveNoWorkspace) {
  Run(ModelOf(views));
  SparseModel model = ModelOf(views);
  model.cameras[3].width = 121;
  EXPECT_NE(ErrorOf([&] { Run(model); }).find("121 x 100"), std::string::npos);
  EXPECT_THROW(ReadWorkspace(folder / "dense"), Error);
  const std::string bytes = ReadFile(folder / "views/004.tif");
  WriteFileAtomically(folder / "views/004.tif", bytes.substr(0, bytes.size() / 2));
  EXPECT_NE(ErrorOf([&] { Run(ModelOf(views)); }).find("004.tif"), std::string::npos);
  std::filesystem::remove(folder / "views/004.tif");
  EXPECT_NE(ErrorOf([&] { Run(ModelOf(views)); }).find("004.tif"), std::string::npos);
}

TEST_F(UndistortStage, StopsWhenCancelled) {
  progress.Cancel();
  EXPECT_THROW(Run(ModelOf(views)), Cancelled);
}

TEST_F(UndistortStage, ACopyFromTheSamePlaceIsLeftOutAndNamed) {
  SparseModel model = ModelOf(views);
  Rigid& copy = model.images.at(14).cam_from_world;  // of view 2, as far off as structure from motion errs
  copy = model.images.at(13).cam_from_world;
  copy.translation += Eigen::Vector3d(3e-3, 3e-3, 3e-3);
  const Workspace workspace = Run(model);
  ASSERT_EQ(workspace.views.size(), 5u);
  EXPECT_EQ(workspace.views[2].name, "002");
  EXPECT_EQ(workspace.views[3].name, "004");
  EXPECT_TRUE(progress.Heard("the same place: 002 and 003"));
  EXPECT_FALSE(std::filesystem::exists(folder / "dense/polar/003.tif"));
  EXPECT_EQ(ReadSparseModel(folder / "dense/sparse").images.size(), 5u);
}

TEST_F(UndistortStage, ViewsOfOnePlaceThatShowDifferentThingsStayAndAreOneWitness) {
  SparseModel model = ModelOf(views);
  model.images.at(14).cam_from_world =
      Rigid{Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY()).toRotationMatrix(), Eigen::Vector3d::Zero()} *
      model.images.at(13).cam_from_world;
  const Workspace workspace = Run(model);
  ASSERT_EQ(workspace.views.size(), 6u);
  EXPECT_EQ(Places(workspace.views), (std::vector<int>{0, 1, 2, 2, 4, 5}));
  EXPECT_TRUE(progress.Heard("the same place: 002 and 003"));
  for (const DenseView& view : workspace.views) {
    const auto count = std::ranges::count_if(view.sources, [](int s) { return s == 2 || s == 3; });
    EXPECT_LE(count, view.name == "002" || view.name == "003" ? 0 : 1) << view.name;
  }
}

TEST_F(UndistortStage, DifferentPlacesAreNotBlamed) {
  Run(ModelOf(views));
  EXPECT_TRUE(progress.warnings.empty());
}

}  // namespace
}  // namespace polarscan
