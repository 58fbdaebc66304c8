// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "core/image.h"
#include "core/mesh.h"
#include "core/progress.h"
#include "fusion/surface/refinement/normal_fit.h"
#include "fusion/surface/surface_views.h"

namespace polarscan {

// Points that lie outside of the masks of views from two places or more, by more than `margin_px`. What a
// picture does not show counts where its mask keeps clear of the border by that, so that the picture shows
// all of the object.
std::vector<bool> OutsideOfMasks(const std::vector<Eigen::Vector3d>& points, const SurfaceViews& views,
                                 double margin_px, Progress& progress);

// How far the outline of a view's mask lies outside of the mesh's own outline, beside one vertex of that.
struct OutlinePull {
  std::uint32_t vertex = 0;
  double distance_px = 0;  // along the vertex's projected normal; negative: the mask ends inside
  Eigen::Vector2d out = Eigen::Vector2d::Zero();  // unit, in the picture: the vertex's projected normal
  double pixel = 0;  // world length of a pixel there: moving the vertex so far along its normal
                     // moves the outline by one pixel
};

// The pulls of one view (mask: 255 = object). Asked are vertices where the surface turns away from the camera
// with nothing of the mesh beside them. Both outlines are found between pixels: the mask's by interpolation,
// at most `reach_px` away; the mesh's by rays (it lies up to a triangle beyond the vertex, and that would
// inflate the mesh).
std::vector<OutlinePull> OutlinePulls(const TriangleMesh& mesh, const RayCaster& caster,
                                      const DenseView& view, const Image<std::uint8_t>& mask,
                                      double reach_px);

// The outlines of all views' masks. Masks may be drawn too wide or too narrow as a whole: the median of the
// first call's pulls tells, and what it has beyond kSubPixel is left out from then on. Masks may be ragged:
// the median distance that is left tells, and all pulls count by 1 / (1 + (that / kSubPixel)^2).
class Silhouettes {
 public:
  static constexpr double kSubPixel = 0.3;  // what the outlines of good masks and good depths may differ by

  // Reads the masks. A view without one pulls nothing.
  Silhouettes(const SurfaceViews& views, double reach_px);
  // One pull a vertex: the mean of what the views say.
  std::vector<Pull> Pulls(const TriangleMesh& mesh, Progress& progress);

 private:
  const std::vector<DenseView> views_;
  double reach_px_;
  std::vector<Image<std::uint8_t>> masks_;
  std::optional<double> bias_px_;  // known after the first call
};

}  // namespace polarscan
