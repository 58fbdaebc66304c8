// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/colmap/dense_export.h"

#include "core/formats/ply.h"
#include "stereo/map_io.h"
#include "stereo/sfm/model/camera_models.h"
#include "tests/sfm/helpers.h"

namespace polarscan {
namespace {

const Eigen::Vector3d kNormal =
    Eigen::Vector3d(0.5, -0.3, -1).normalized();  // of the plane kNormal . X = kOffset
constexpr double kOffset = -3.5;

// Four cameras side by side before a slanted plane; small pictures, so that half a pixel is much.
Workspace SlantedPlane(const std::filesystem::path& folder) {
  Workspace workspace{folder, {}, false};
  for (int i = 0; i < 4; ++i) {
    const std::string name(1, char('a' + i));
    const Rigid pose = LookAt({0.15 * i, 0.1 * (i % 2), 0}, {0.3, 0, 4}, {0, -1, 0});
    workspace.views.push_back({name, {80, 60, 100, 105, 41, 29.5}, pose, 2.5, 5.5, {}});
    for (int j = 0; j < 4; ++j)
      if (j != i) workspace.views.back().sources.push_back(j);
  }
  return workspace;
}

// Exact maps at the pixels' centres, by our convention.
void WriteExactMaps(const Workspace& workspace) {
  for (int i = 0; i < 4; ++i) {
    const DenseView& view = workspace.views[std::size_t(i)];
    const Pinhole& camera = view.camera;
    Image<float> depth(camera.width, camera.height);
    Image<Eigen::Vector3f> normal(camera.width, camera.height,
                                  (view.cam_from_world.rotation * kNormal).cast<float>());
    const Eigen::Vector3d centre = view.cam_from_world.Center();
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        const Eigen::Vector3d ray = view.cam_from_world.rotation.transpose() * camera.Ray(x + 0.5, y + 0.5);
        depth(x, y) = float((kOffset - kNormal.dot(centre)) / kNormal.dot(ray));
      }
    WriteDepthMap(workspace.DepthPath(i, kFinalMaps), depth);
    WriteNormalMap(workspace.NormalPath(i, kFinalMaps), normal);
    WritePng(workspace.PicturePath(i), Image<std::uint8_t>(camera.width, camera.height, 128));
  }
}

class DenseExport : public FolderTest {
 protected:
  struct Residual {
    std::size_t points = 0;
    double mean = 0, worst = 0;  // signed distance to the plane: mean, largest size
  };
  // COLMAP's fused points against the plane. depth: how many views it may follow a point through.
  Residual Fuse(int depth) {
    Progress progress;
    RunProcess(
        {"colmap", "stereo_fusion", "--workspace_path", folder, "--input_type", "geometric", "--output_path",
         folder / "fused.ply", "--StereoFusion.min_num_pixels", depth > 1 ? "3" : "1",
         "--StereoFusion.max_traversal_depth", std::to_string(depth), "--StereoFusion.num_threads", "1"},
        folder / "log", progress, 120);
    const PlyElement vertices = ReadPly(folder / "fused.ply").at("vertex");
    Residual residual{vertices.count};
    for (std::size_t i = 0; i < vertices.count; ++i) {
      const Eigen::Vector3d point(vertices.columns.at("x")[i], vertices.columns.at("y")[i],
                                  vertices.columns.at("z")[i]);
      const double distance = kNormal.dot(point) - kOffset;
      residual.mean += distance / double(vertices.count);
      residual.worst = std::max(residual.worst, std::abs(distance));
    }
    return residual;
  }
};

TEST_F(DenseExport, ColmapsFusionPutsOurMapsExactlyOnTheSurface) {
  if (!HasColmap()) GTEST_SKIP() << "COLMAP is not installed";
  const Workspace workspace = SlantedPlane(folder);
  WriteExactMaps(workspace);
  const SparseModel model = ModelOf(workspace.views);
  WriteColmapWorkspace(workspace, model);
  const Residual single = Fuse(1), fused = Fuse(100);
  EXPECT_EQ(single.points, 4u * 80 * 60);
  EXPECT_LT(single.worst, 1e-5);
  EXPECT_GT(fused.points, 1000u) << "COLMAP must find out which views overlap";
  EXPECT_LT(std::abs(fused.mean), 1e-3);  // medians of three coordinates leave the plane by a little

  // The trap is real: with the principal point as we keep it, the same maps give a shifted surface.
  SparseModel naive = ColmapSparse(workspace, model);
  for (auto& [id, camera] : naive.cameras) camera.params[2] += 0.5, camera.params[3] += 0.5;
  WriteSparseModelBinary(folder / "sparse", naive);
  EXPECT_GT(Fuse(1).worst, 3e-3);
}

TEST_F(DenseExport, ListsSourcesByName) {
  const Workspace workspace = SlantedPlane(folder);
  WriteColmapWorkspace(workspace, ModelOf(workspace.views));
  EXPECT_EQ(ReadFile(folder / "stereo/patch-match.cfg").substr(0, 24), "a.png\nb.png, c.png, d.pn");
  EXPECT_EQ(ReadFile(folder / "stereo/fusion.cfg"), "a.png\nb.png\nc.png\nd.png\n");
}

TEST_F(DenseExport, ObservationsFollowThePictureThroughLensAndScale) {
  Workspace workspace = SlantedPlane(folder);
  SparseModel model = ModelOf(workspace.views);
  model.cameras[3] = {3, "SIMPLE_RADIAL", 160, 120, {200, 82, 59, -0.1}};
  const Eigen::Vector3d point = workspace.views[0].cam_from_world.Inverse() * Eigen::Vector3d(0.9, -0.7, 3);
  const Lens lens = ToLens(model.cameras[3]);
  std::uint32_t observation = 0;
  for (auto& [id, image] : model.images) {
    const Eigen::Vector2d d = lens.Distort((image.cam_from_world * point).hnormalized());
    image.observations = {{200 * d.x() + 82, 200 * d.y() + 59, 9}};
    model.points[9].track.push_back({id, observation});
  }
  model.points[9].position = point;
  for (DenseView& view : workspace.views) view.camera = lens.pinhole.Resized(80, 60);
  const SparseModel sparse = ColmapSparse(workspace, model);
  for (const auto& [id, image] : sparse.images) {
    const Eigen::Vector2d expected =
        ToPinhole(sparse.cameras.at(image.camera_id)).Project(image.cam_from_world * point);
    EXPECT_NEAR(image.observations[0].x, expected.x(), 1e-9);
    EXPECT_NEAR(image.observations[0].y, expected.y(), 1e-9);
  }
  EXPECT_LT((sparse.points.at(9).position - point).norm(), 1e-12);
}

}  // namespace
}  // namespace polarscan
