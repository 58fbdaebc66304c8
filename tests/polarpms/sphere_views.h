// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "pipeline/stereo/stereo.h"
#include "stereo/map_io.h"
#include "stereo/workspace.h"

namespace polarscan {

inline constexpr int kWidth = 96, kHeight = 80, kViews = 6;
inline constexpr double kDistance = 4, kRadius = 1;

// z-depth at which the ray meets the unit sphere at the world's origin.
inline std::optional<double> SphereDepth(const DenseView& view, const Eigen::Vector3d& ray) {
  const Eigen::Vector3d center = view.cam_from_world * Eigen::Vector3d::Zero();
  const double a = ray.squaredNorm(), b = ray.dot(center), c = center.squaredNorm() - kRadius * kRadius;
  if (b * b < a * c) return std::nullopt;
  return (b - std::sqrt(b * b - a * c)) / a;
}

inline double Texture(const Eigen::Vector3d& p) {
  return 1 + 0.3 * std::sin(9 * p.x() + 2 * p.y()) + 0.3 * std::cos(8 * p.y() - 3 * p.z()) +
         0.2 * std::sin(11 * p.z());
}

// A sphere seen from six places of a ring, textured or not, with diffuse polarization along its azimuths.
class Sphere : public testing::Test {
 protected:
  Sphere() : folder_(std::filesystem::path(testing::TempDir()) / ("sphere." + std::to_string(::getpid()))) {
    std::filesystem::remove_all(folder_);
  }
  ~Sphere() override { std::filesystem::remove_all(folder_); }

  void Write(bool textured) {
    workspace_.folder = folder_;
    workspace_.polarized = true;
    for (int i = 0; i < kViews; ++i) {
      DenseView view{"v" + std::to_string(i),
                     {kWidth, kHeight, 130, 130, kWidth / 2.0, kHeight / 2.0},
                     {},
                     2.5,
                     5.5,
                     {}};
      const double angle = 0.3 * (i - 2.5);
      view.cam_from_world.rotation = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
      view.cam_from_world.translation = {0, 0, kDistance};
      for (int j = 0; j < kViews; ++j)
        if (j != i) view.sources.push_back(j);
      std::ranges::sort(view.sources, {}, [&](int j) { return std::abs(j - i); });
      workspace_.views.push_back(view);
      WriteView(i, textured);
    }
    WriteWorkspace(workspace_);
  }

  void WriteView(int index, bool textured) {
    const DenseView& view = workspace_.views[std::size_t(index)];
    const Image<float> blank(kWidth, kHeight);
    StokesImage stokes{blank, blank, blank, Image<float>(kWidth, kHeight, 1e-4f)};
    Image<std::uint8_t> mask(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const Eigen::Vector3d ray = view.camera.Ray(x + 0.5, y + 0.5);
        const auto depth = SphereDepth(view, ray);
        if (!depth) continue;
        const Eigen::Vector3d p = view.cam_from_world.Inverse() * (*depth * ray),
                              n = view.cam_from_world.rotation * p;
        const double alpha = std::atan2(-(n.y() - n.z() * ray.y()), n.x() - n.z() * ray.x());
        const double cosine = -n.dot(ray.normalized()), dop = 0.2 * (1 - cosine);
        mask(x, y) = 255;
        stokes.s0(x, y) = float(textured ? 0.5 * Texture(p) : 0.8);
        stokes.s1(x, y) = float(stokes.s0(x, y) * dop * std::cos(2 * alpha));
        stokes.s2(x, y) = float(stokes.s0(x, y) * dop * std::sin(2 * alpha));
      }
    if (spoil_) spoil_(stokes);
    WriteStokes(workspace_.StokesPath(index), stokes);
    WritePng(workspace_.MaskPath(index), mask);
  }

  struct Errors {
    double median_depth = 0, median_normal_deg = 0, estimated = 0;
  };
  // Over the pixels of all views, a missing one counted as 1 and 90 degrees.
  Errors Compare(const MapKind& kind = kFinalMaps) const {
    std::vector<double> depths, normals;
    double estimated = 0;
    for (int i = 0; i < kViews; ++i) {
      const DenseView& view = workspace_.views[std::size_t(i)];
      const Image<float> depth = ReadDepthMap(workspace_.DepthPath(i, kind));
      const Image<Eigen::Vector3f> normal = ReadNormalMap(workspace_.NormalPath(i, kind));
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const Eigen::Vector3d ray = view.camera.Ray(x + 0.5, y + 0.5);
          const auto truth = SphereDepth(view, ray);
          if (!truth) continue;
          const Eigen::Vector3d n = *truth * ray - view.cam_from_world * Eigen::Vector3d::Zero();
          const bool there = depth(x, y) > 0;
          estimated += there;
          depths.push_back(there ? std::abs(depth(x, y) - *truth) : 1);
          const double cosine = normal(x, y).cast<double>().dot(n);
          normals.push_back(there ? std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi : 90);
        }
    }
    const double count = double(depths.size());
    std::ranges::sort(depths);
    std::ranges::sort(normals);
    return {depths[depths.size() / 2], normals[normals.size() / 2], estimated / count};
  }

  static StereoOptions Quick(const std::string& preset) {
    StereoOptions options = StereoPreset(preset);
    options.photometric_iterations = 2;
    options.geometric_iterations = 1;
    options.window_radius = 3;
    options.window_step = 1;
    options.filter = false;
    options.surfaces = 0;
    return options;
  }

  std::string AllBytes() const {
    std::string bytes;
    for (int i = 0; i < kViews; ++i)
      bytes += ReadFile(workspace_.DepthPath(i, kFinalMaps)) + ReadFile(workspace_.NormalPath(i, kFinalMaps));
    return bytes;
  }

  std::filesystem::path folder_;
  std::function<void(StokesImage&)> spoil_;  // of every view, before it is written
  Workspace workspace_;
  Progress progress_;
};

}  // namespace polarscan
