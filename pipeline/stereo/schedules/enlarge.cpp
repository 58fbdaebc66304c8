// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/schedules/enlarge.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "stereo/costs/cost_terms.h"

namespace polarscan {
namespace {

// The depth at a pixel of the whole size on the plane of a pixel of half the size. Steep planes do not carry it
// far away.
float DepthOnHalfPixel(const Hypothesis& plane, const Pinhole& half_camera, int hx, int hy,
                       const Pinhole& camera, int x, int y) {
  const float depth = DepthOnPlane(plane, half_camera.Ray(hx + 0.5, hy + 0.5).cast<float>(),
                                   camera.Ray(x + 0.5, y + 0.5).cast<float>());
  return std::clamp(depth, 0.95f * plane.depth, 1.05f * plane.depth);
}

// make(x, y, hx, hy): the estimate of a pixel, which the pixel (hx, hy) of half the size covers; depth 0: none.
template <class Make>
DepthNormalMap MakeLarger(const Pinhole& camera, const Pinhole& half_camera, Make&& make) {
  DepthNormalMap map{Image<float>(camera.width, camera.height),
                     Image<Eigen::Vector3f>(camera.width, camera.height, Eigen::Vector3f::Zero())};
  ParallelFor(0, camera.height, [&](int y) {
    for (int x = 0; x < camera.width; ++x) {
      const Hypothesis made =
          make(x, y, std::min(x / 2, half_camera.width - 1), std::min(y / 2, half_camera.height - 1));
      map.depth(x, y) = made.depth;
      map.normal(x, y) = made.normal;
    }
  });
  return map;
}

}  // namespace

DepthNormalMap Enlarged(const DepthNormalMap& half, const Pinhole& camera) {
  const Pinhole half_camera = HalfCamera(camera);
  return MakeLarger(camera, half_camera, [&](int x, int y, int hx, int hy) -> Hypothesis {
    const Hypothesis estimate{half.depth(hx, hy), half.normal(hx, hy)};
    if (estimate.depth <= 0) return {};
    return {DepthOnHalfPixel(estimate, half_camera, hx, hy, camera, x, y), estimate.normal};
  });
}

DepthNormalMap EnlargedByGray(const DepthNormalMap& half, const Pinhole& camera, const Image<float>& gray,
                              const Image<float>& half_gray) {
  constexpr float kSigmaGray = 0.05f, kSigmaPixels = 1;  // of grey in [0, 1]; of the half size
  const Pinhole half_camera = HalfCamera(camera);
  return MakeLarger(camera, half_camera, [&](int x, int y, int hx, int hy) -> Hypothesis {
    Hypothesis sum;
    float weights = 0;
    for (int v = std::max(0, hy - 1); v <= std::min(half_camera.height - 1, hy + 1); ++v)
      for (int u = std::max(0, hx - 1); u <= std::min(half_camera.width - 1, hx + 1); ++u) {
        const Hypothesis estimate{half.depth(u, v), half.normal(u, v)};
        if (estimate.depth <= 0) continue;
        const float dx = float(u) + 0.5f - (float(x) + 0.5f) / 2,
                    dy = float(v) + 0.5f - (float(y) + 0.5f) / 2;
        const float apart = half_gray(u, v) - gray(x, y);
        const float weight = std::exp(-(dx * dx + dy * dy) / (2 * kSigmaPixels * kSigmaPixels) -
                                      apart * apart / (2 * kSigmaGray * kSigmaGray)) +
                             1e-6f;
        sum.depth += weight * DepthOnHalfPixel(estimate, half_camera, u, v, camera, x, y);
        sum.normal += weight * estimate.normal;
        weights += weight;
      }
    const float length = sum.normal.norm();
    return weights > 0 && length > 0 ? Hypothesis{sum.depth / weights, sum.normal / length} : Hypothesis{};
  });
}

}  // namespace polarscan
