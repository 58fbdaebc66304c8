// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <fmt/format.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>
#include <string>

#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "core/mesh.h"
#include "core/random.h"
#include "demosaic/stokes.h"
#include "stereo/map_io.h"
#include "stereo/sfm/model/model.h"
#include "stereo/workspace.h"

// Workspaces with maps of the unit sphere in closed form, in a folder that goes away with its owner.
namespace polarscan {

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "polarscan-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline Rigid LookAtOrigin(const Eigen::Vector3d& centre) {
  const Eigen::Vector3d z = -centre.normalized(), x = Eigen::Vector3d(0.1, -1, 0.05).cross(z).normalized();
  Rigid pose;
  pose.rotation.row(0) = x.transpose();
  pose.rotation.row(1) = z.cross(x).transpose();
  pose.rotation.row(2) = z.transpose();
  pose.translation = -(pose.rotation * centre);
  return pose;
}

// `count` cameras on a circle of radius 4 around the y axis, 20 degrees apart, at different heights.
inline Workspace SphereWorkspace(const std::filesystem::path& folder, int count) {
  Workspace workspace;
  workspace.folder = folder;
  workspace.polarized = true;
  for (int i = 0; i < count; ++i) {
    const double angle = i * 20 * std::numbers::pi / 180;
    const Eigen::Vector3d centre(4 * std::sin(angle), i % 2 ? 1 : -0.3, 4 * std::cos(angle));
    DenseView view{
        fmt::format("v{}", 100 + i), {160, 120, 200, 210, 81.5, 58}, LookAtOrigin(centre), 2.5, 6, {}};
    for (int j = 0; j < count; ++j)
      if (j != i) view.sources.push_back(j);
    workspace.views.push_back(view);
  }
  return workspace;
}

struct SphereMaps {
  Image<float> depth;
  Image<Eigen::Vector3f> normal;
};

// z of the first hit of the ray through each pixel's centre, and the outward normal, camera frame.
inline SphereMaps ExactSphereMaps(const DenseView& view) {
  const int width = view.camera.width, height = view.camera.height;
  SphereMaps maps{{width, height}, {width, height, Eigen::Vector3f::Zero()}};
  const Eigen::Vector3d t = view.cam_from_world.translation;  // the sphere's centre in the camera frame
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const Eigen::Vector3d ray = view.camera.Ray(x + 0.5, y + 0.5);
      const double a = ray.squaredNorm(), b = ray.dot(t), under_root = b * b - a * (t.squaredNorm() - 1);
      if (under_root <= 0) continue;
      const double z = (b - std::sqrt(under_root)) / a;
      maps.depth(x, y) = float(z);
      maps.normal(x, y) = (z * ray - t).cast<float>();
    }
  return maps;
}

// The colour of the sphere's surface, by the outward normal in the world.
inline Rgb8 SphereColour(const Eigen::Vector3d& n) {
  const Eigen::Vector3d c = 128 * Eigen::Vector3d::Ones() + 100 * n;
  return {std::uint8_t(c.x()), std::uint8_t(c.y()), std::uint8_t(c.z())};
}

constexpr float kSphereDop = 0.3f;

// Writes maps, pictures, polarization and views.json. `change(view, maps)` may damage a view's maps on the
// way.
inline void WriteSphere(
    const Workspace& workspace, const std::function<void(int, SphereMaps&)>& change = [](int, SphereMaps&) {},
    const MapKind& kind = kFinalMaps) {
  WriteWorkspace(workspace);
  for (int i = 0; i < int(workspace.views.size()); ++i) {
    const DenseView& view = workspace.views[std::size_t(i)];
    SphereMaps maps = ExactSphereMaps(view);
    const int width = maps.depth.width(), height = maps.depth.height();
    Image<Rgb8> picture(width, height);
    StokesImage stokes{
        {width, height, 1.f}, {width, height, kSphereDop}, {width, height}, {width, height, 0.01f}};
    for (std::size_t k = 0; k < picture.size(); ++k)
      picture.pixels()[k] =
          SphereColour(view.cam_from_world.rotation.transpose() * maps.normal.pixels()[k].cast<double>());
    change(i, maps);
    WritePng(workspace.PicturePath(i), picture);
    WriteStokes(workspace.StokesPath(i), stokes);
    WriteDepthMap(workspace.DepthPath(i, kind), maps.depth);
    WriteNormalMap(workspace.NormalPath(i, kind), maps.normal);
  }
}

// Masks of the pixels that see the sphere.
inline void WriteSphereMasks(const Workspace& workspace) {
  for (int view = 0; view < int(workspace.views.size()); ++view) {
    const Image<float> depth = ExactSphereMaps(workspace.views[std::size_t(view)]).depth;
    Image<std::uint8_t> mask(depth.width(), depth.height());
    for (std::size_t i = 0; i < depth.size(); ++i) mask.pixels()[i] = depth.pixels()[i] > 0 ? 255 : 0;
    WritePng(workspace.MaskPath(view), mask);
  }
}

// Views of the unit sphere, textured, with diffuse polarization, noise and masks.
inline Workspace LitSphere(const std::filesystem::path& folder, int count, int width, int height) {
  Workspace workspace = SphereWorkspace(folder, count);
  for (DenseView& view : workspace.views) {
    view.camera = view.camera.Resized(width, height);
    const auto own = Eigen::Vector3d(view.cam_from_world.Center());
    std::ranges::sort(view.sources, {}, [&](int other) {
      return (workspace.views[std::size_t(other)].cam_from_world.Center() - own).norm();
    });
  }
  WriteWorkspace(workspace);
  for (int i = 0; i < count; ++i) {
    const DenseView& view = workspace.views[std::size_t(i)];
    const SphereMaps maps = ExactSphereMaps(view);
    Image<Rgb8> picture(width, height);
    StokesImage stokes{{width, height, 0.3f}, {width, height}, {width, height}, {width, height, 0.004f}};
    Random random(11, std::uint64_t(i));
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const auto noise = [&] { return float(0.004 * std::numbers::sqrt2 * random.Normal()); };
        if (maps.depth(x, y) > 0) {
          const Eigen::Vector3d n = maps.normal(x, y).cast<double>(), ray = view.camera.Ray(x + 0.5, y + 0.5);
          const Eigen::Vector3d at = view.cam_from_world.rotation.transpose() * n;
          const double azimuth = std::atan2(-(n.y() - n.z() * ray.y()), n.x() - n.z() * ray.x());
          const double wave = std::sin(13 * at.x() + 3 * at.y()) + std::cos(11 * at.y() - 4 * at.z());
          const double s0 = at.x() > 0.4 ? 0.5 : 0.5 + 0.1 * wave;  // a part without texture
          const double dop = 0.2 * (1 - std::pow(n.dot(ray.normalized()), 2));
          stokes.s0(x, y) = float(s0);
          stokes.s1(x, y) = float(s0 * dop * std::cos(2 * azimuth));
          stokes.s2(x, y) = float(s0 * dop * std::sin(2 * azimuth));
        }
        stokes.s0(x, y) += noise(), stokes.s1(x, y) += noise(), stokes.s2(x, y) += noise();
        const auto level = std::uint8_t(255 * std::clamp(stokes.s0(x, y), 0.0f, 1.0f));
        picture(x, y) = {level, level, level};
      }
    WriteStokes(workspace.StokesPath(i), stokes);
    WritePng(workspace.PicturePath(i), picture);
  }
  WriteSphereMasks(workspace);
  return workspace;
}

// The unit sphere in `rings` rings of latitude; its triangles lie at most (pi / rings)^2 / 2 inside.
inline TriangleMesh SphereMesh(int rings) {
  TriangleMesh mesh;
  const int columns = 2 * rings;
  for (int i = 0; i <= rings; ++i)
    for (int j = 0; j < columns; ++j) {
      const double latitude = std::numbers::pi * i / rings, longitude = 2 * std::numbers::pi * j / columns;
      mesh.vertices.emplace_back(std::sin(latitude) * std::cos(longitude),
                                 std::sin(latitude) * std::sin(longitude), std::cos(latitude));
    }
  const auto at = [columns](int i, int j) { return std::uint32_t(i * columns + j % columns); };
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < columns; ++j) {
      if (i > 0) mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
      if (i + 1 < rings) mesh.triangles.push_back({at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)});
    }
  mesh.normals = mesh.vertices;
  return mesh;
}

// A square in the plane z = height, from -half to half, facing +z.
inline TriangleMesh SquareMesh(double half, double height) {
  TriangleMesh mesh;
  mesh.vertices = {
      {-half, -half, height}, {half, -half, height}, {half, half, height}, {-half, half, height}};
  mesh.normals.assign(4, Eigen::Vector3d::UnitZ());
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

// The workspace's cameras as a COLMAP model; `shift` is added to the principal points (-0.5 for COLMAP's
// dense tools).
inline SparseModel ToModel(const Workspace& workspace, double shift) {
  SparseModel model;
  for (std::size_t i = 0; i < workspace.views.size(); ++i) {
    const DenseView& view = workspace.views[i];
    const Pinhole& c = view.camera;
    const auto id = std::uint32_t(i + 1);
    model.cameras[id] = {id, "PINHOLE", c.width, c.height, {c.fx, c.fy, c.cx + shift, c.cy + shift}};
    model.images[id].id = model.images[id].camera_id = id;
    model.images[id].cam_from_world = view.cam_from_world;
    model.images[id].name = view.name + ".png";
  }
  return model;
}

}  // namespace polarscan
