// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <memory>
#include <vector>

#include "stereo/costs/stereo_view.h"

namespace polarscan {

// A depth and normal hypothesis for a reference pixel: z-depth and unit normal in the camera frame, n . ray <
// 0.
struct Hypothesis {
  float depth = 0;
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
};

// A source view seen from the reference view.
struct Source {
  std::shared_ptr<const StereoView> view;
  std::shared_ptr<const DepthNormalMap> map;  // of the photometric pass; null in that pass
  Eigen::Matrix3f rotation;                   // source_from_reference
  Eigen::Vector3f translation;
  Eigen::Vector3f center;  // the source camera's centre in the reference frame
  // The first two columns of K_s R K_r^-1 (it takes reference pixels to source pixels for points at
  // infinity), and K_s t.
  Eigen::Vector3f pixel_du, pixel_dv, pixel_translation;
  float fx = 0, fy = 0, cx = 0, cy = 0;  // of the source camera
};

// Where a source sees a point of the reference frame.
struct Seen {
  float x, y;  // normalised coordinates in the source
  int u, v;    // the nearest pixel; -1: behind the source or outside of its picture
  bool inside() const { return u >= 0; }
};

// p: in the source camera's frame.
inline Seen LookAt(const Source& source, const Eigen::Vector3f& p) {
  if (p.z() <= 0) return {0, 0, -1, -1};
  const float inverse = 1 / p.z(), x = p.x() * inverse, y = p.y() * inverse;
  const float u = source.fx * x + source.cx, v = source.fy * y + source.cy;
  const bool inside =
      u >= 0 && v >= 0 && u < float(source.view->packed.width) && v < float(source.view->packed.height);
  return inside ? Seen{x, y, int(u), int(v)} : Seen{x, y, -1, -1};
}

// point: in the reference camera's frame.
inline Seen Look(const Source& source, const Eigen::Vector3f& point) {
  return LookAt(source, source.rotation * point + source.translation);
}

// One reference view with all that its estimation needs. Frames: everything in the reference camera's.
struct Problem {
  const StereoView* reference = nullptr;
  std::vector<Source> sources;
  float depth_min = 0, depth_max = 0;
  int view_index = 0;  // key of the random numbers

  // Direction with z = 1 through the pixel's centre.
  Eigen::Vector3f Ray(int x, int y) const {
    const Pinhole& c = reference->camera;
    return {(float(x) + 0.5f - float(c.cx)) / float(c.fx), (float(y) + 0.5f - float(c.cy)) / float(c.fy),
            1.0f};
  }
  bool Active(int x, int y) const { return reference->mask.empty() || reference->mask(x, y) != 0; }
};

Source MakeSource(const StereoView& reference, std::shared_ptr<const StereoView> view,
                  std::shared_ptr<const DepthNormalMap> map);

// The homography of the plane through depth * ray with the hypothesis' normal, around the ray's pixel.
// turned_ray: source.rotation * ray.
Warp PlaneWarp(const Pinhole& reference, const Source& source, const Eigen::Vector3f& ray,
               const Eigen::Vector3f& turned_ray, const Hypothesis& hypothesis);

}  // namespace polarscan
