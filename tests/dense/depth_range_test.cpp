// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/depth_range.h"

#include "core/mesh.h"
#include "stereo/sfm/model/camera_models.h"
#include "tests/sfm/helpers.h"

namespace polarscan {
namespace {

// The silhouette of a ball around the origin.
Image<std::uint8_t> BallMask(const DenseView& view, double radius) {
  Image<std::uint8_t> mask(view.camera.width, view.camera.height);
  const Eigen::Vector3d centre = view.cam_from_world * Eigen::Vector3d(0, 0, 0);
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x) {
      const Eigen::Vector3d ray = view.camera.Ray(x + 0.5, y + 0.5).normalized();
      if (ray.cross(centre).norm() < radius) mask(x, y) = 255;
    }
  return mask;
}

std::vector<CoarseMask> BallMasks(const std::vector<DenseView>& views, double radius) {
  std::vector<CoarseMask> masks;
  for (const DenseView& view : views) masks.push_back(Coarsen(BallMask(view, radius)));
  return masks;
}

TEST(DepthRange, HullOfABallContainsTheBallAndLittleMore) {
  const std::vector<DenseView> views = Ring(24);
  const auto masks = BallMasks(views, 0.5);
  for (int i = 0; i < 24; i += 5) {
    const auto range = RangeFromMasks(views, i, masks, {0.8, 20});
    ASSERT_TRUE(range);
    EXPECT_LT(range->min, 3.5);
    EXPECT_GT(range->max, 4.5);
    EXPECT_GT(range->min, 2.8);  // the hull of a ring bulges towards its axis
    EXPECT_LT(range->max, 5.2);
  }
}

TEST(DepthRange, AFewWrongMasksDoNotEmptyTheHull) {
  const std::vector<DenseView> views = Ring(24);
  auto masks = BallMasks(views, 0.5);
  masks[3] = Coarsen(Image<std::uint8_t>(120, 100, 0));
  masks[9] = {};
  const auto range = RangeFromMasks(views, 0, masks, {0.8, 20});
  ASSERT_TRUE(range);
  EXPECT_LT(range->min, 3.5);
  EXPECT_GT(range->max, 4.5);
}

TEST(DepthRange, WithoutOtherMasksThereIsNoHull) {
  const std::vector<DenseView> views = Ring(6);
  std::vector<CoarseMask> masks(6);
  EXPECT_FALSE(RangeFromMasks(views, 0, masks, {0.8, 20}));
  masks[0] = Coarsen(BallMask(views[0], 0.5));
  masks[1] = Coarsen(BallMask(views[1], 0.5));
  EXPECT_FALSE(RangeFromMasks(views, 0, masks, {0.8, 20}));
}

TEST(DepthRange, PointsGiveColmapsPercentiles) {
  std::vector<DenseView> views = Ring(2);
  for (DenseView& view : views) view.cam_from_world = Rigid{};
  std::vector<ScenePoint> points;
  for (int i = 0; i <= 1000; ++i) points.push_back({{0, 0, 2 + i * 0.002}, {0, 1}});
  points.push_back({{0, 0, 1e-3}, {0, 1}});  // one wild point at each end
  points.push_back({{0, 0, 1e6}, {0, 1}});
  const auto range = RangeFromPoints(views[0], 0, points);
  ASSERT_TRUE(range);
  EXPECT_NEAR(range->min, 0.75 * 2.02, 0.01);
  EXPECT_NEAR(range->max, 1.25 * 3.98, 0.01);
  points.resize(10);
  EXPECT_FALSE(RangeFromPoints(views[0], 0, points));
}

TEST(DepthRange, MasksWinOverPointsAndCamerasAreTheLastResort) {
  const std::vector<DenseView> views = Ring(12);
  std::vector<ScenePoint> far;  // points of a background at depth 8 or so
  for (int i = 0; i < 100; ++i) far.push_back({{0.01 * i, -4, 0}, {0, 1, 2}});
  Progress progress;
  EXPECT_LT(EstimateDepthRanges(views, far, BallMasks(views, 0.5), progress)[0].max, 5.2);
  const auto ranges = EstimateDepthRanges(views, far, std::vector<CoarseMask>(12), progress);
  EXPECT_GT(ranges[0].max, 5.2);
  EXPECT_NEAR(ranges[7].min, 4.0 / 3, 1e-9);  // sees no points
  EXPECT_NEAR(ranges[7].max, 12, 1e-9);
}

TEST(DepthRange, CoarseMasksNeverLoseAPixel) {
  Image<std::uint8_t> mask(1001, 37);
  mask(1000, 36) = 255;
  mask(500, 3) = 255;
  const CoarseMask coarse = Coarsen(mask, 100);
  EXPECT_EQ(coarse.factor, 11);
  EXPECT_EQ(coarse.cells(1000 / 11, 36 / 11), 255);
  EXPECT_EQ(coarse.cells(500 / 11, 0), 255);
  EXPECT_EQ(std::ranges::count(coarse.cells.pixels(), 255), 2);
}

TEST(DepthRange, RenderedBunnyLiesInItsHull) {
  const std::filesystem::path set = POLARSCAN_SHARED "/data/rendered/bunny-plastic";
  if (!std::filesystem::exists(set / "sparse")) GTEST_SKIP() << "no " << set;
  const SparseModel model = ReadSparseModel(set / "sparse");
  const TriangleMesh mesh = ReadMesh(set / "truth/mesh.ply");
  std::vector<DenseView> views;
  std::vector<CoarseMask> masks;
  for (const auto& [id, image] : model.images) {
    const std::string stem = std::filesystem::path(image.name).stem();
    views.push_back({stem, ToPinhole(model.cameras.at(image.camera_id)), image.cam_from_world, 0, 0, {}});
    masks.push_back(Coarsen(ReadMask(set / "masks" / (stem + ".png"))));
  }
  Progress progress;
  const auto ranges = EstimateDepthRanges(views, {}, masks, progress);
  for (std::size_t i = 0; i < views.size(); ++i) {
    double nearest = 1e9, farthest = 0;
    for (const Eigen::Vector3d& vertex : mesh.vertices) {
      nearest = std::min(nearest, Depth(views[i], vertex));
      farthest = std::max(farthest, Depth(views[i], vertex));
    }
    EXPECT_LT(ranges[i].min, nearest) << views[i].name;
    EXPECT_GT(ranges[i].max, farthest) << views[i].name;
    EXPECT_LT(ranges[i].max - ranges[i].min, 2.0 * (farthest - nearest)) << views[i].name;
  }
}

}  // namespace
}  // namespace polarscan
