// SPDX-License-Identifier: Apache-2.0
#include "simulation/camera_rings.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "core/error.h"
#include "core/files/files.h"
#include "core/random.h"

namespace polarscan {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Rows: the camera's x, y, z axes in the world.
Matrix3d LookAtOrigin(double elevation, double azimuth, double roll) {
  const Vector3d z = -Vector3d(std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                               std::cos(elevation) * std::cos(azimuth));
  const Vector3d x = z.cross(Vector3d::UnitY()).normalized(), y = z.cross(x);
  Matrix3d rotation;
  rotation.row(0) = (std::cos(roll) * x + std::sin(roll) * y).transpose();
  rotation.row(1) = (std::cos(roll) * y - std::sin(roll) * x).transpose();
  rotation.row(2) = z.transpose();
  return rotation;
}

// Distance from which the point, seen along the camera's axis through the origin, is within the half angles.
double DistanceFor(const Vector3d& p, double tan_x, double tan_y) {
  return std::max(std::abs(p.x()) / tan_x, std::abs(p.y()) / tan_y) - p.z();
}

}  // namespace

std::vector<CameraRing> ParseRings(const std::string& text) {
  const auto refuse = [&text]() -> void {
    throw Error("not a list of camera rings", '"' + text + '"',
                "Write elevation:views, for example 33:12,56:6");
  };
  std::vector<CameraRing> rings;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, ',');) {
    CameraRing ring;
    char colon = 0, rest = 0;
    std::istringstream words(part);
    if (!(words >> ring.elevation_deg >> colon >> ring.views) || colon != ':' || words >> rest) refuse();
    if (ring.views < 1 || ring.views > 10000 || !(std::abs(ring.elevation_deg) <= 85)) refuse();
    rings.push_back(ring);
  }
  if (rings.empty()) refuse();
  return rings;
}

std::vector<SimulatedPose> RingViews(const std::vector<CameraRing>& rings, double jitter_deg,
                                     std::uint64_t seed, const TriangleMesh& object, const Pinhole& camera,
                                     double fill, bool turntable) {
  constexpr double kRadians = std::numbers::pi / 180;
  std::vector<SimulatedPose> views;
  double distance = 0, shift = 0;
  for (const CameraRing& ring : rings) {
    for (int i = 0; i < ring.views; ++i) {
      Random random(seed, 3, views.size());
      const auto jitter = [&] { return jitter_deg * (2 * random.Uniform() - 1); };
      const double camera_moves = turntable ? 0 : 1;
      const double elevation = ring.elevation_deg + camera_moves * jitter(),
                   azimuth = 360 * (i + shift) / ring.views + jitter();
      const Matrix3d r =
          LookAtOrigin(elevation * kRadians, azimuth * kRadians, camera_moves * jitter() * kRadians);
      for (const Vector3d& v : object.vertices)
        distance = std::max(distance, DistanceFor(r * v, fill * camera.width / 2 / camera.fx,
                                                  fill * camera.height / 2 / camera.fy));
      views.push_back(
          {fmt::format("{:06}", views.size()), {r, Vector3d::Zero()}, turntable ? azimuth * kRadians : 0});
    }
    shift += 1.0 / 3;
  }
  for (SimulatedPose& view : views) view.cam_from_world.translation = {0, 0, std::max(distance, 1.2)};
  return views;
}

void WriteTruePoses(const std::filesystem::path& folder, const Pinhole& camera,
                    const std::vector<SimulatedPose>& views) {
  WriteFileAtomically(
      folder / "cameras.txt",
      fmt::format(
          "# CAMERA_ID MODEL WIDTH HEIGHT fx fy cx cy\n1 PINHOLE {} {} {:.12g} {:.12g} {:.12g} {:.12g}\n",
          camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy));
  std::string text = "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME; then a line of observations (none)\n";
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Eigen::Quaterniond q(views[i].cam_from_world.rotation);
    const Vector3d& t = views[i].cam_from_world.translation;
    text += fmt::format("{} {:.15g} {:.15g} {:.15g} {:.15g} {:.15g} {:.15g} {:.15g} 1 {}.png\n\n", i + 1,
                        q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z(), views[i].name);
  }
  WriteFileAtomically(folder / "images.txt", text);
  WriteFileAtomically(folder / "points3D.txt", "# POINT3D_ID X Y Z R G B ERROR TRACK (none)\n");
}

}  // namespace polarscan
