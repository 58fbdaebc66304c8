// SPDX-License-Identifier: Apache-2.0
// polarscan stereo as the PatchMatch that COLMAP lacks without CUDA: between colmap image_undistorter and
// colmap stereo_fusion.
#include <gtest/gtest.h>

#include <cmath>

#include "core/files/files.h"
#include "core/mesh.h"
#include "fusion/cloud/cloud.h"
#include "program.h"
#include "stereo/sfm/model/model.h"
#include "toy_scan.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

Outcome RunColmap(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "colmap");
  return Process(arguments, {{"QT_QPA_PLATFORM", "offscreen"}}).Wait(120);
}

// Poses of the ball's pictures, their names moved into a folder, and points on the ball as structure from
// motion would find them: COLMAP's fusion learns from shared points which pictures overlap.
void WriteModel(const fs::path& known, const fs::path& folder) {
  SparseModel model = ReadSparseModel(known);
  model.points.clear();
  for (auto& [id, image] : model.images) image.name = "ring/" + image.name, image.observations.clear();
  for (int k = 0; k < 600; ++k) {
    const double y = 1 - 2 * (k + 0.5) / 600, radius = std::sqrt(1 - y * y), around = 2.39996 * k;
    const std::uint64_t id = std::uint64_t(k) + 1;
    ColmapPoint point{{radius * std::cos(around), y, radius * std::sin(around)}, {}, 0, {}};
    for (auto& [image_id, image] : model.images) {
      const Eigen::Vector3d to_camera = image.cam_from_world.Center() - point.position;
      if (point.position.dot(to_camera.normalized()) < 0.3) continue;
      const Eigen::Vector2d pixel =
          ToPinhole(model.cameras.at(image.camera_id)).Project(image.cam_from_world * point.position);
      point.track.push_back({image_id, std::uint32_t(image.observations.size())});
      image.observations.push_back({pixel.x(), pixel.y(), std::int64_t(id)});
    }
    if (point.track.size() > 1)
      model.points[id] = point;
    else
      for (const auto& track : point.track) model.images.at(track.image_id).observations.pop_back();
  }
  fs::create_directories(folder);
  WriteSparseModelText(folder, model);
}

// Share of a cloud's points within `distance` of the ball of radius 1.
double ShareOnBall(const fs::path& ply, double distance, std::size_t at_least) {
  const CloudPositions cloud = ReadCloudPositions(ply);
  EXPECT_GT(cloud.points.size(), at_least) << ply;
  double near = 0;
  for (const Eigen::Vector3d& point : cloud.points) near += std::abs(point.norm() - 1) < distance;
  return near / double(std::max<std::size_t>(1, cloud.points.size()));
}

class ColmapWorkspace : public testing::Test {
 protected:
  void SetUp() override {
    if (!HasProgram("colmap")) GTEST_SKIP() << "colmap is not installed";
    WriteMesh(folder_ / "ball.ply", Ball());
    const Outcome simulated =
        RunPolarscan({"simulate", "-o", (folder_ / "input").string(), "--mesh",
                      (folder_ / "ball.ply").string(), "--no-table", "--texture", "strong", "--samples", "1",
                      "--masks", "--known-poses", "--rings", "30:10", "--width", "128", "--height", "112"});
    ASSERT_EQ(simulated.exit_code, 0) << simulated.err;
    const fs::path pictures = folder_ / "pictures";
    ASSERT_EQ(RunPolarscan({"demosaic", (folder_ / "input").string(), "-o", (pictures / "ring").string()})
                  .exit_code,
              0);
    WriteModel(folder_ / "input" / "sparse", folder_ / "model");
    const Outcome undistorted = RunColmap({"image_undistorter", "--image_path", pictures.string(),
                                           "--input_path", (folder_ / "model").string(), "--output_path",
                                           Workspace().string(), "--output_type", "COLMAP"});
    ASSERT_EQ(undistorted.exit_code, 0) << undistorted.out << undistorted.err;
  }
  fs::path Workspace() const { return folder_ / "dense"; }

  TemporaryFolder folder_;
};

TEST_F(ColmapWorkspace, GetsMapsThatColmapFuses) {
  fs::create_directories(Workspace() / "masks");
  fs::copy(folder_ / "input" / "masks", Workspace() / "masks" / "ring");
  const std::string sparse = ReadFile(Workspace() / "sparse/images.bin");
  const Outcome stereo = RunPolarscan({"stereo", Workspace().string(), "--preset", "fast"});
  ASSERT_EQ(stereo.exit_code, 0) << stereo.err;
  EXPECT_NE(stereo.err.find("the polarization term is neglected"), std::string::npos) << stereo.err;
  EXPECT_EQ(ReadFile(Workspace() / "sparse/images.bin"), sparse);

  const fs::path fused = Workspace() / "fused.ply";
  const Outcome fusion =
      RunColmap({"stereo_fusion", "--workspace_path", Workspace().string(), "--input_type", "geometric",
                 "--output_path", fused.string(), "--StereoFusion.min_num_pixels", "3"});
  ASSERT_EQ(fusion.exit_code, 0) << fusion.out << fusion.err;
  EXPECT_GT(ShareOnBall(fused, 0.03, 1000), 0.9);

  const Outcome own = RunPolarscan({"fuse", Workspace().string()});
  ASSERT_EQ(own.exit_code, 0) << own.err;
  EXPECT_GT(ShareOnBall(Workspace() / "cloud.ply", 0.03, 1000), 0.9);
}

TEST_F(ColmapWorkspace, WithDistortionOrWithoutAPictureIsRefusedByName) {
  SparseModel model = ReadSparseModel(Workspace() / "sparse");
  const auto write = [&] {
    fs::remove_all(Workspace() / "sparse");
    fs::create_directories(Workspace() / "sparse");
    WriteSparseModelText(Workspace() / "sparse", model);
  };
  ColmapCamera& camera = model.cameras.begin()->second;
  const ColmapCamera pinhole = camera;
  camera.model = "SIMPLE_RADIAL", camera.params = {100, 64, 56, 0.1};
  write();
  const Outcome distorted = RunPolarscan({"stereo", Workspace().string()});
  EXPECT_EQ(distorted.exit_code, kFailed);
  EXPECT_NE(distorted.err.find("SIMPLE_RADIAL"), std::string::npos) << distorted.err;
  camera = pinhole;
  write();
  const fs::path picture = Workspace() / "images" / model.images.begin()->second.name;
  fs::remove(picture);
  const Outcome missing = RunPolarscan({"stereo", Workspace().string()});
  EXPECT_EQ(missing.exit_code, kFailed);
  EXPECT_NE(missing.err.find(picture.filename().string()), std::string::npos) << missing.err;
}

}  // namespace
}  // namespace polarscan::test
