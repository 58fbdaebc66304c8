// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/common_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "fusion/cloud/fuse.h"
#include "fusion/mesh_topology.h"
#include "fusion/surface/poisson/poisson.h"
#include "pipeline/meshing.h"

namespace polarscan {
namespace {

constexpr std::size_t kMostPoints = 2'000'000;  // that make the surface: every second, third, ... of more
constexpr std::size_t kLeastCloud = 100;
constexpr double kCell = 2.2;  // px, of the octree that makes the surface: coarser ones lose detail
constexpr int kFinestDepth = 12;
constexpr std::size_t kMostCells = 1'000'000;  // of the octree: coarser steps are taken for more ...
constexpr int kMostCoarser = 3;                // ... but no more than these
constexpr float kSame = 0.02f;         // share of the depth by which an estimate may differ from a membrane
constexpr float kLeastFacing = 0.02f;  // cosine between a normal and the line of sight

// Of more than kMostPoints every second, third, ...
std::vector<CloudPoint> FusedCloud(const Workspace& workspace, const MapKind& maps,
                                   const StereoOptions& options, Progress& progress) {
  FusionOptions fusion;
  fusion.masks = options.masks;
  std::vector<CloudPoint> cloud = FusePoints(workspace, maps, fusion, progress);
  const std::size_t every = 1 + (cloud.size() - 1) / kMostPoints;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < cloud.size(); i += every) cloud[kept++] = cloud[i];
  cloud.resize(kept);
  cloud.shrink_to_fit();
  return cloud;
}

// Of the octree whose cells are about kCell pixels wide; coarser, in steps, for a scene of too many. Throws
// NothingFound where even the coarsest has too many.
int OctreeDepth(const std::vector<CloudPoint>& cloud, const Workspace& workspace) {
  const double pixel = PixelSize(cloud, workspace);
  int finest = kCoarsestDepth;
  while (PoissonCell(cloud, finest) > kCell * pixel) ++finest;
  int depth = std::min(finest, kFinestDepth);
  while (depth > std::max(kCoarsestDepth, finest - kMostCoarser) && OccupiedCells(cloud, depth) > kMostCells)
    --depth;
  if (depth < finest - kMostCoarser || OccupiedCells(cloud, depth) > kMostCells)
    throw NothingFound("the scene is too large for one surface as fine as its pictures", workspace.folder);
  return depth;
}

// Turned so far that it faces the camera.
Eigen::Vector3f Facing(const Eigen::Vector3f& normal, const Eigen::Vector3f& ray) {
  const Eigen::Vector3f sight = ray.normalized();
  const float away = normal.dot(sight) + kLeastFacing;
  return away <= 0 ? normal : (normal - away * sight).normalized();
}

}  // namespace

RefineOptions RefinementBy(const StereoOptions& options) {
  RefineOptions refinement;
  refinement.polarization = options.polarization;
  refinement.masks = options.masks;
  refinement.aop_noise_deg = options.aop_noise_deg;
  return refinement;
}

CommonSurface MakeCommonSurface(const Workspace& workspace, const MapKind& maps, const StereoOptions& options,
                                HullSupport& hull, const GoesOn& goes_on, Progress& progress) {
  std::vector<CloudPoint> cloud = FusedCloud(workspace, maps, options, progress);
  if (cloud.size() < kLeastCloud)
    throw NothingFound(fmt::format("{} points that views agree on are too few for a surface", cloud.size()),
                       workspace.folder);
  MeshOptions meshing;
  meshing.refinement = RefinementBy(options);
  if (options.hull_support && hull.AddTo(cloud, workspace, progress))
    meshing.refinement.photometric *= HullSupport::kPhotometric;
  meshing.depth = OctreeDepth(cloud, workspace);
  meshing.silhouette_margin_px = options.silhouette_margin_px;
  MeshSummary summary;
  CloudSurface surface = MakeSurface(cloud, workspace, meshing, summary, progress, goes_on);
  return {RayCaster({std::move(surface.mesh)}), std::move(surface.far)};
}

DepthNormalMap Drawn(const CommonSurface& surface, const DenseView& view, bool masked,
                     const DepthNormalMap& own) {
  DepthNormalMap map = own;
  const Eigen::Matrix3d& rotation = view.cam_from_world.rotation;
  const Eigen::Vector3d centre = view.cam_from_world.Center();
  ParallelFor(0, own.depth.height(), [&](int y) {
    for (int x = 0; x < own.depth.width(); ++x) {
      if (own.depth(x, y) <= 0) continue;
      const Eigen::Vector3d ray = view.camera.Ray(x + 0.5, y + 0.5);
      const RayCaster::Hit hit = surface.caster.Cast(centre, rotation.transpose() * ray);
      if (hit.mesh < 0) continue;
      const auto depth = float(hit.distance);  // the ray's z is 1
      const Triangle& triangle = surface.caster.meshes()[0].triangles[std::size_t(hit.triangle)];
      const bool borne_out =
          !surface.far[triangle[0]] && !surface.far[triangle[1]] && !surface.far[triangle[2]];
      if (!masked && !borne_out && std::abs(depth / own.depth(x, y) - 1) > kSame) continue;
      map.depth(x, y) = depth;
      map.normal(x, y) = Facing((rotation * surface.caster.Normal(hit)).cast<float>(), ray.cast<float>());
    }
  });
  return map;
}

}  // namespace polarscan
