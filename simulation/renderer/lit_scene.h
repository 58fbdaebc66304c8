// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "core/mesh.h"
#include "core/progress.h"
#include "simulation/renderer/optics.h"
#include "simulation/scene/scene.h"

namespace polarscan {

// A scene with the light that enters its surfaces, which no camera changes: environment light with shadows,
// and what the object and the table throw at each other once (the object as if it glowed evenly, the table as
// printed).
struct LitScene {
  Scene scene;
  RayCaster solids;  // the object (mesh 0) and the blocks (mesh 1); the table is met by its formula
  std::vector<std::vector<float>> solid_light;  // per mesh and vertex: irradiance that passed the surface
  Image<float> table_light;                     // over the table top, like the print: the same
  double object_glow = 0;                       // mean inner radiance of the object
};

LitScene Illuminate(Scene scene, Progress& progress);

// What a ray meets first.
struct Meeting {
  enum Thing { kNothing, kObject, kTable /* or a block */ } thing = kNothing;
  double distance = 0;
  Eigen::Vector3d point, normal;  // normal: interpolated, unit
  double body = 0;                // radiance inside the surface (BodyRadiance times the light that entered)
  const Material* material = nullptr;
};

// `direction` is unit. coarse: the blurred print and the object's mean albedo, for light on its second way.
Meeting Meet(const LitScene& lit, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
             bool coarse);

// Samples of a rough surface's facets: many for the object, fewer for the table, whose highlights are wide.
struct FacetSamples {
  std::vector<DiscPoint> object, table;
};

// Stokes vector of the light that comes to `origin` from `direction` (world; unit), counted in the frame of
// its pixel. facets: samples of the surface's roughness, each used with its mirror image. Behind the scene
// there is the room, or a dim floor, unpolarized.
Eigen::Vector3d StokesAlong(const LitScene& lit, const Eigen::Vector3d& origin,
                            const Eigen::Vector3d& direction, const Eigen::Matrix3d& cam_from_world,
                            const PolarFrame& frame, const FacetSamples& facets);

}  // namespace polarscan
