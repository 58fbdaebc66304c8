// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "fusion/cloud/cloud.h"
#include "fusion/cloud/maps.h"

namespace polarscan {

// Limits within which another view's estimate agrees with a pixel's.
struct ConsistencyLimits {
  double reprojection_px, relative_depth, normal_deg;
};

// How the questions "does that view agree with this pixel?" ended.
struct ConsistencyCounts {
  std::size_t agreed = 0;
  std::size_t outside = 0;       // behind that camera or out of its picture
  std::size_t no_depth = 0;      // nothing estimated there
  std::size_t depth = 0;         // relative depth differs too much
  std::size_t seen_through = 0;  // places from which a surface farther away is seen, through this point
  std::size_t reprojection = 0;  // too many pixels back in the first view
  std::size_t normal = 0;        // normals differ too much
  ConsistencyCounts& operator+=(const ConsistencyCounts& other);
};

// One agreeing view.
struct Agreement {
  int view;               // index into the list of candidates
  int place;              // that it was taken from, one of `places`
  Eigen::Vector2d pixel;  // where the first view's point projects to; inside of pixel (x, y)
  int x, y;
  Eigen::Vector3d point;  // its surface point, world
  double residual;        // 0 (same point, same normal) to 1 (at the limits): mean of the three tests
};

// A pixel with an estimate, as a point in the world.
struct SurfacePoint {
  Eigen::Vector3d position, normal;
};
SurfacePoint BackProject(const ViewMaps& view, int x, int y);

// Area of the surface patch that a pixel with an estimate sees, world units squared.
double PatchArea(const ViewMaps& view, int x, int y);

// The place of a view from where the reference was taken, too: it sees nothing that the reference does not.
inline constexpr int kOwnPlace = -1;

// Which of `candidates` agree with pixel (x, y) of `reference`. places: of the candidates, those of one place
// one after the other. The other view's depth is taken exactly where the point projects to, from the plane of
// the nearest pixel's depth and normal, so that the reprojection error measures the surfaces' distance and
// not the rounding to whole pixels. Geometry: forward-backward check as in COLMAP and ACMMP.
void FindAgreements(const ViewMaps& reference, int x, int y,
                    const std::vector<std::shared_ptr<const ViewMaps>>& candidates,
                    const std::vector<int>& places, const ConsistencyLimits& limits,
                    std::vector<Agreement>& agreements, ConsistencyCounts& counts);

// How many places other than the reference's agree.
std::size_t PlacesOf(const std::vector<Agreement>& agreements);

// Normal, colour and DoP: means over the reference pixel and the pixels that agree with it, each weighted by
// the cosine of its angle of view. Position: on the reference pixel's ray, at the same mean of where it meets
// the pixels' tangent planes. Confidence in [0, 1): 1 - exp(-s), s = sum over agreeing places of sin(a) (1 -
// residual), with a the angle at the point between that view and the reference (90 degrees at most): many
// views from well apart that agree well. Of a place's views the best counts.
CloudPoint FusePixel(const ViewMaps& reference, int x, int y,
                     const std::vector<std::shared_ptr<const ViewMaps>>& candidates,
                     const std::vector<Agreement>& agreements);

}  // namespace polarscan
