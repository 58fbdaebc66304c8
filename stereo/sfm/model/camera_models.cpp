// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/model/camera_models.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace polarscan {
namespace {

constexpr CameraModel kModels[] = {
    {0, "SIMPLE_PINHOLE", 3},
    {1, "PINHOLE", 4},
    {2, "SIMPLE_RADIAL", 4},
    {3, "RADIAL", 5},
    {4, "OPENCV", 8},
    {5, "OPENCV_FISHEYE", 8},
    {6, "FULL_OPENCV", 12},
    {7, "FOV", 5},
    {8, "SIMPLE_RADIAL_FISHEYE", 4},
    {9, "RADIAL_FISHEYE", 5},
    {10, "THIN_PRISM_FISHEYE", 12},
    {11, "RAD_TAN_THIN_PRISM_FISHEYE", 16},
};

Eigen::Matrix2d DistortionJacobian(const Lens& lens, const Eigen::Vector2d& point) {
  const double x = point.x(), y = point.y(), r2 = x * x + y * y;
  const double radial = 1 + r2 * (lens.k1 + r2 * lens.k2), slope = 2 * lens.k1 + 4 * r2 * lens.k2;
  Eigen::Matrix2d j;
  j(0, 0) = radial + x * x * slope + 2 * lens.p1 * y + 6 * lens.p2 * x;
  j(1, 1) = radial + y * y * slope + 6 * lens.p1 * y + 2 * lens.p2 * x;
  j(0, 1) = j(1, 0) = x * y * slope + 2 * lens.p1 * x + 2 * lens.p2 * y;
  return j;
}

// FULL_OPENCV whose last four parameters, k3 to k6, are 0.
bool IsOpencv(const ColmapCamera& camera) {
  return camera.model == "FULL_OPENCV" && camera.params.size() == 12 &&
         std::all_of(camera.params.begin() + 8, camera.params.end(), [](double k) { return k == 0; });
}

ColmapCamera WithoutZeros(ColmapCamera camera) {
  camera.model = "OPENCV";
  camera.params.resize(8);
  return camera;
}

}  // namespace

int FocalLengths(const std::string& model) {
  const bool one = model.starts_with("SIMPLE_") || model.starts_with("RADIAL");
  return one ? 1 : 2;
}

const CameraModel* FindCameraModel(int id) {
  const auto found = std::ranges::find(kModels, id, &CameraModel::id);
  return found == std::end(kModels) ? nullptr : found;
}

const CameraModel* FindCameraModel(const std::string& name) {
  const auto found =
      std::ranges::find_if(kModels, [&](const CameraModel& model) { return name == model.name; });
  return found == std::end(kModels) ? nullptr : found;
}

Eigen::Vector2d Lens::Distort(const Eigen::Vector2d& point) const {
  const double x = point.x(), y = point.y(), r2 = x * x + y * y;
  const double radial = 1 + r2 * (k1 + r2 * k2);
  return {x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
          y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
}

Eigen::Vector2d Lens::Undistort(const Eigen::Vector2d& distorted) const {
  Eigen::Vector2d point = distorted;
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector2d step = DistortionJacobian(*this, point).inverse() * (Distort(point) - distorted);
    if (!step.allFinite()) return distorted;
    point -= step;
    if (step.norm() < 1e-14) return point;
  }
  return (Distort(point) - distorted).norm() < 1e-9 ? point : distorted;
}

Lens ToLens(const ColmapCamera& camera) {
  const CameraModel* model = FindCameraModel(camera.model);
  if (IsOpencv(camera)) return ToLens(WithoutZeros(camera));
  if (!model || model->id > 4)
    throw Error(
        camera.model == "FULL_OPENCV" ? "k3 to k6 of this lens model are supported only as 0"
                                      : "this lens model is not supported",
        camera.model,
        "Use SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL or OPENCV, or undistort the pictures before");
  const std::vector<double>& p = camera.params;
  if (int(p.size()) != model->parameters || camera.width <= 0 || camera.height <= 0)
    throw Error(fmt::format("camera {} has {} parameters or an impossible size", camera.id, p.size()),
                camera.model);
  const std::size_t two = FocalLengths(camera.model) == 2;
  Lens lens{{camera.width, camera.height, p[0], p[two], p[two + 1], p[two + 2]}};
  if (!(lens.pinhole.fx > 0) || !(lens.pinhole.fy > 0))
    throw Error(fmt::format("camera {} has no positive focal length", camera.id), camera.model);
  const std::size_t rest = two + 3;
  if (rest < p.size()) lens.k1 = p[rest];
  if (rest + 1 < p.size()) lens.k2 = p[rest + 1];
  if (rest + 3 < p.size()) lens.p1 = p[rest + 2], lens.p2 = p[rest + 3];
  return lens;
}

Pinhole ToPinhole(const ColmapCamera& camera) {
  const Lens lens = ToLens(camera);
  if (!lens.IsPinhole())
    throw Error("a camera without lens distortion was expected",
                fmt::format("camera {} ({})", camera.id, camera.model), "Undistort the pictures first");
  return lens.pinhole;
}

ColmapCamera Resized(const ColmapCamera& camera, int width, int height) {
  if (camera.width == width && camera.height == height) return camera;
  const double sx = double(width) / camera.width, sy = double(height) / camera.height;
  if (std::abs(camera.height * sx - height) > 1.0 && std::abs(camera.width * sy - width) > 1.0)
    throw Error(fmt::format("the camera is for pictures of {} x {} pixels, the picture has {} x {}: another "
                            "shape, not only another size",
                            camera.width, camera.height, width, height),
                fmt::format("camera {}", camera.id),
                "Give the camera of these pictures, neither cut out nor turned");
  ColmapCamera resized = camera;
  resized.width = width;
  resized.height = height;
  const std::size_t two = FocalLengths(camera.model) == 2;
  resized.params.at(0) *= sx;
  if (two) resized.params.at(1) *= sy;
  resized.params.at(two + 1) *= sx;
  resized.params.at(two + 2) *= sy;
  return resized;
}

}  // namespace polarscan
