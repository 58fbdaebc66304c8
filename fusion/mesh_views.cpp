// SPDX-License-Identifier: Apache-2.0
#include "fusion/mesh_views.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace polarscan {
namespace {

constexpr double kLeastCosine = 0.1;  // between normal and line of sight
constexpr double kLift = 1e-3;        // of the distance to the camera: where rays begin

// Of one view, by Embree.
std::vector<bool> VisibleFrom(const DenseView& view, const TriangleMesh& mesh, const RayCaster& caster) {
  const Eigen::Vector3d centre = view.cam_from_world.Center();
  std::vector<bool> visible(mesh.vertices.size(), false);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d& vertex = mesh.vertices[i];
    const Eigen::Vector3d to_camera = centre - vertex;
    if (mesh.normals[i].dot(to_camera) < kLeastCosine * to_camera.norm()) continue;
    const Eigen::Vector3d p = view.cam_from_world * vertex;
    if (p.z() <= 0) continue;
    const Eigen::Vector2d at = view.camera.Project(p);
    if (at.x() < 0 || at.y() < 0 || at.x() >= view.camera.width || at.y() >= view.camera.height) continue;
    visible[i] = !caster.Occluded(vertex + kLift * to_camera, to_camera);
  }
  return visible;
}

}  // namespace

std::vector<std::vector<bool>> VisibleVertices(const TriangleMesh& mesh, const Workspace& workspace,
                                               Progress& progress) {
  const RayCaster caster({mesh});
  std::vector<std::vector<bool>> visible(workspace.views.size());
  ParallelFor(0, int(visible.size()), [&](int view) {
    progress.Check();
    visible[std::size_t(view)] = VisibleFrom(workspace.views[std::size_t(view)], mesh, caster);
  });
  return visible;
}

PolarSample SamplePolar(const Image<PolarSample>& polar, double u, double v) {
  const int left = int(std::floor(u - 0.5)), top = int(std::floor(v - 0.5));
  const float right_share = float(u - 0.5 - left), low_share = float(v - 0.5 - top);
  float along = 0, across = 0, dop = 0, weight = 0;
  for (int y = 0; y < 2; ++y)
    for (int x = 0; x < 2; ++x) {
      if (!polar.Contains(left + x, top + y)) return {1, 0, 0, 0};
      const PolarSample& p = polar(left + x, top + y);
      if (p.weight <= 0) return {1, 0, 0, 0};
      const float share = (x ? right_share : 1 - right_share) * (y ? low_share : 1 - low_share);
      along += share * p.dop * (p.cos_phi * p.cos_phi - p.sin_phi * p.sin_phi);
      across += share * p.dop * 2 * p.cos_phi * p.sin_phi;
      dop += share * p.dop, weight += share * p.weight;
    }
  const float phi = std::atan2(across, along) / 2, length = std::hypot(along, across);
  return {std::cos(phi), std::sin(phi), dop > 0 ? weight * length / dop : 0, length};
}

void AddAopConstraints(const TriangleMesh& mesh, const StereoView& view, const std::vector<bool>& visible,
                       VertexConstraints& constraints) {
  if (view.polar.empty()) return;
  const Eigen::Matrix3f world_from_cam = view.cam_from_world.rotation.transpose().cast<float>();
  ParallelFor(0, int(mesh.vertices.size()), [&](int i) {
    const auto vertex = std::size_t(i);
    if (!visible[vertex]) return;
    const Eigen::Vector3d p = view.cam_from_world * mesh.vertices[vertex];
    const Eigen::Vector2d at = view.camera.Project(p);
    const PolarSample sample = SamplePolar(view.polar, at.x(), at.y());
    if (sample.weight <= 0) return;
    AopConstraint constraint = MakeAopConstraint(sample, float(p.x() / p.z()), float(p.y() / p.z()));
    constraint.diffuse = world_from_cam * constraint.diffuse;
    constraint.specular = world_from_cam * constraint.specular;
    constraints[vertex].push_back(constraint);
  });
}

}  // namespace polarscan
