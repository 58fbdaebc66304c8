// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstdint>

#include "core/formats/image_io.h"
#include "core/random.h"
#include "tests/fusion/sphere_scene.h"

namespace polarscan {

inline constexpr int kSphereWidth = 320, kSphereHeight = 240;  // a pixel is 0.01 wide on the unit sphere

// Cameras around the unit sphere. Pictures of light that the sphere reflects diffusely: AoP = azimuth of the
// normal, DoP rises with its tilt; noise as given. Masks are those of a sphere of radius `mask_radius`. S0 is
// 0.5, more or less by up to `texture`.
inline Workspace PolarSphere(const std::filesystem::path& folder, double noise, double mask_radius = 1,
                             double texture = 0) {
  Workspace workspace = SphereWorkspace(folder, 18);
  for (DenseView& view : workspace.views) view.camera = view.camera.Resized(kSphereWidth, kSphereHeight);
  WriteWorkspace(workspace);
  for (int i = 0; i < int(workspace.views.size()); ++i) {
    const DenseView& view = workspace.views[std::size_t(i)];
    const Eigen::Vector3d t = view.cam_from_world.translation;  // the sphere's centre
    StokesImage stokes{{kSphereWidth, kSphereHeight, 0.5f},
                       {kSphereWidth, kSphereHeight},
                       {kSphereWidth, kSphereHeight},
                       {kSphereWidth, kSphereHeight, 0.001f}};
    Image<std::uint8_t> mask(kSphereWidth, kSphereHeight);
    Random random(11, std::uint64_t(i));
    for (int y = 0; y < kSphereHeight; ++y)
      for (int x = 0; x < kSphereWidth; ++x) {
        const Eigen::Vector3d ray = view.camera.Ray(x + 0.5, y + 0.5);
        const double a = ray.squaredNorm(), b = ray.dot(t);
        const double off = t.squaredNorm() - b * b / a;  // squared distance of the centre from the ray
        mask(x, y) = off < mask_radius * mask_radius ? 255 : 0;
        if (off >= 1) continue;
        const Eigen::Vector3d n = (b - std::sqrt(b * b - a * (t.squaredNorm() - 1))) / a * ray - t;
        const Eigen::Vector3d at = view.cam_from_world.rotation.transpose() * n;
        for (int wave = 0; wave < 9; ++wave) {  // 9 to 25 pixels long, in directions that differ
          const Eigen::Vector3d along(std::sin(4.1 * wave), std::cos(2.3 * wave), std::sin(wave + 1.0));
          stokes.s0(x, y) +=
              float(texture / 9 * std::sin((25 + 5 * wave) * at.dot(along.normalized()) + wave));
        }
        const double azimuth = std::atan2(-(n.y() - n.z() * ray.y()), n.x() - n.z() * ray.x());
        const double polarized = 0.5 * 0.3 * (1 - std::pow(n.dot(ray.normalized()), 2));
        stokes.s1(x, y) = float(polarized * std::cos(2 * azimuth) + noise * random.Normal());
        stokes.s2(x, y) = float(polarized * std::sin(2 * azimuth) + noise * random.Normal());
      }
    WriteStokes(workspace.StokesPath(i), stokes);
    WritePng(workspace.MaskPath(i), mask);
  }
  return workspace;
}

}  // namespace polarscan
