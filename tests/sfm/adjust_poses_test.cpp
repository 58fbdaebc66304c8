// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/adjust_poses.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/random.h"
#include "core/similarity.h"
#include "stereo/sfm/alignment.h"

namespace polarscan {
namespace {

constexpr int kCameras = 16, kPoints = 400;
constexpr double kDistance = 5, kFocal_px = 1000;

// Cameras on a ring look at a cloud of points around 0, through a lens with distortion.
struct CameraRing {
  SparseModel truth;

  explicit CameraRing(double noise_px) {
    truth.cameras[1] = {1, "SIMPLE_RADIAL", 640, 512, {kFocal_px, 320, 256, -0.1}};
    Random random(3);
    for (std::uint64_t id = 0; id < kPoints; ++id)
      truth.points[id].position = {random.Normal() * 0.5, random.Normal() * 0.5, random.Normal() * 0.5};
    for (int k = 0; k < kCameras; ++k) AddImage(k, noise_px, random);
  }

  void AddImage(int k, double noise_px, Random& random) {
    const double turn = 2 * std::numbers::pi * k / kCameras;
    const Eigen::Matrix3d rotation = (Eigen::AngleAxisd(0.5 + 0.1 * (k % 3), Eigen::Vector3d::UnitX()) *
                                      Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY()))
                                         .toRotationMatrix();
    const auto id = std::uint32_t(k + 1);
    ColmapImage image{id, 1, {rotation, {0, 0, kDistance}}, std::to_string(k) + ".png", {}};
    for (auto& [point_id, point] : truth.points) {
      const Eigen::Vector3d p = image.cam_from_world * point.position;
      const double x = p.x() / p.z(), y = p.y() / p.z(), stretch = 1 - 0.1 * (x * x + y * y);
      point.track.push_back({id, std::uint32_t(image.observations.size())});
      image.observations.push_back({kFocal_px * x * stretch + 320 + noise_px * random.Normal(),
                                    kFocal_px * y * stretch + 256 + noise_px * random.Normal(),
                                    std::int64_t(point_id)});
    }
    truth.images[id] = image;
  }

  // Rotations and centres are off by so many standard deviations of 1 px on the points.
  SparseModel Given(double off_px, std::uint64_t seed = 8) const {
    SparseModel given = truth;
    for (auto& [id, image] : given.images) {
      Random random(seed, id);
      const double turn = off_px / kFocal_px, shift = turn * kDistance;
      const auto error = [&] { return Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()); };
      const Eigen::Vector3d axis = turn * error();
      const Eigen::Vector3d centre = image.cam_from_world.Center() + shift * error();
      Eigen::Matrix3d& rotation = image.cam_from_world.rotation;
      rotation = Eigen::AngleAxisd(axis.norm(), axis.normalized()).toRotationMatrix() * rotation;
      image.cam_from_world.translation = -(rotation * centre);
    }
    return given;
  }

  // Root mean square distance of the centres from the true ones.
  double Off(const SparseModel& model) const {
    double sum = 0;
    for (const auto& [id, image] : model.images)
      sum += (image.cam_from_world.Center() - truth.images.at(id).cam_from_world.Center()).squaredNorm();
    return std::sqrt(sum / kCameras);
  }
  double OffAligned(const SparseModel& model) const {
    return AlignCameras(Poses(model), Poses(truth)).errors.rms;
  }
};

TEST(AdjustPoses, OfPicturesWithoutErrorsFindsTheTruePosesButForTheWorldsPlace) {
  const CameraRing ring(0);
  const SparseModel given = ring.Given(3);
  SparseModel model = given;
  const AdjustmentFigures figures = AdjustPoses(model, given, 4, Progress());
  EXPECT_LT(ring.OffAligned(model), 0.02 * ring.OffAligned(given));
  EXPECT_LT(ring.Off(model),
            0.7 * ring.Off(given));  // place, turn and scale are those of the given ones' mean
  EXPECT_NEAR(figures.rotation_rad, 3 / kFocal_px, 0.4 * 3 / kFocal_px);
  EXPECT_NEAR(figures.centre, 3 / kFocal_px * kDistance, 0.4 * 3 / kFocal_px * kDistance);
  EXPECT_EQ(figures.dropped, 0);
}

TEST(AdjustPoses, PosesThatAreBetterThanThePicturesStay) {
  const CameraRing ring(1);
  SparseModel free = ring.Given(0), given = free;
  const AdjustmentFigures figures = AdjustPoses(free, given, 8, Progress());
  EXPECT_NEAR(figures.observation_px, 1, 0.1);
  const SparseModel off = ring.Given(3);
  SparseModel by_pictures = off;  // these poses hardly help
  AdjustPoses(by_pictures, off, 8, Progress());
  EXPECT_LT(ring.OffAligned(free), 0.5 * ring.OffAligned(by_pictures));
}

TEST(AdjustPoses, OnePoseThatIsFarOffIsMendedAndDoesNotPullTheOthers) {
  const CameraRing ring(0.2);
  SparseModel given = ring.Given(0.2);
  const SparseModel good = given;
  const Rigid far = ring.Given(12, 9).images.at(5).cam_from_world;
  given.images.at(5).cam_from_world = far;
  SparseModel model = given, without = good;
  AdjustPoses(model, given, 4, Progress());
  AdjustPoses(without, good, 4, Progress());
  const auto off = [&](const SparseModel& m) {
    return (m.images.at(5).cam_from_world.Center() - ring.truth.images.at(5).cam_from_world.Center()).norm();
  };
  EXPECT_LT(off(model), 0.1 * off(given));
  EXPECT_LT(ring.Off(model), 1.5 * ring.Off(without));
}

TEST(AdjustPoses, WrongMatchesAreDroppedAndDoNotCount) {
  const CameraRing ring(0.2);
  SparseModel given = ring.Given(1);
  SparseModel model = given;
  for (auto& [id, image] : model.images)
    for (std::size_t i = id; i < image.observations.size(); i += 20) image.observations[i].x += 12;
  SparseModel sound = given;
  const AdjustmentFigures figures = AdjustPoses(model, given, 4, Progress());
  AdjustPoses(sound, given, 4, Progress());
  EXPECT_NEAR(figures.dropped, kCameras * kPoints / 20, 0.01 * kCameras * kPoints / 20);
  EXPECT_LT(ring.Off(model), 1.2 * ring.Off(sound));
  for (const auto& [id, image] : model.images)
    for (std::size_t i = 0; i < image.observations.size(); ++i)
      EXPECT_EQ(image.observations[i].point_id < 0, i >= id && (i - id) % 20 == 0) << id << " " << i;
}

}  // namespace
}  // namespace polarscan
