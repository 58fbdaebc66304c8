// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <memory>
#include <vector>

#include "stereo/polarpms/view.h"

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
  Eigen::Vector3f center;          // the source camera's centre in the reference frame
  Eigen::Matrix3f pixel_rotation;  // K_s R K_r^-1: reference pixels to source pixels for points at infinity
  Eigen::Vector3f pixel_translation;     // K_s t
  float fx = 0, fy = 0, cx = 0, cy = 0;  // of the source camera
};

// Where a source sees a point of the reference frame.
struct Seen {
  float x, y;  // normalised coordinates in the source
  int u, v;    // the nearest pixel; -1: behind the source or outside of its picture
  bool inside() const { return u >= 0; }
};

inline Seen Look(const Source& source, const Eigen::Vector3f& point) {
  const Eigen::Vector3f p = source.rotation * point + source.translation;
  if (p.z() <= 0) return {0, 0, -1, -1};
  const float x = p.x() / p.z(), y = p.y() / p.z();
  const float u = source.fx * x + source.cx, v = source.fy * y + source.cy;
  const bool inside =
      u >= 0 && v >= 0 && u < float(source.view->packed.width) && v < float(source.view->packed.height);
  return inside ? Seen{x, y, int(u), int(v)} : Seen{x, y, -1, -1};
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

// The homography of the plane through depth * ray with the hypothesis' normal, around reference pixel (x, y).
Warp PlaneWarp(const Pinhole& reference, const Source& source, int x, int y, const Eigen::Vector3f& ray,
               const Hypothesis& hypothesis);

}  // namespace polarscan
