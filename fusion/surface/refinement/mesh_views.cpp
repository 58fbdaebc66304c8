// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/refinement/mesh_views.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/parallel.h"

namespace polarscan {
namespace {

constexpr double kLeastCosine = 0.1;  // between normal and line of sight
constexpr double kLift = 1e-3;        // of the distance to the camera: where rays begin
constexpr float kFixed = 8192;        // constraints' directions, no longer than 4, in 16 bits

// Of one view, by Embree.
std::vector<bool> VisibleFrom(const DenseView& view, const TriangleMesh& mesh, const RayCaster& caster) {
  const Eigen::Vector3d centre = view.cam_from_world.Center();
  std::vector<bool> visible(mesh.vertices.size(), false);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d& vertex = mesh.vertices[i];
    const Eigen::Vector3d to_camera = centre - vertex;
    if (mesh.normals[i].dot(to_camera) < kLeastCosine * to_camera.norm()) continue;
    if (!view.camera.Sees(view.cam_from_world * vertex)) continue;
    visible[i] = !caster.Occluded(vertex + kLift * to_camera, to_camera);
  }
  return visible;
}

}  // namespace

std::vector<std::vector<bool>> VisibleVertices(const TriangleMesh& mesh, const std::vector<DenseView>& views,
                                               Progress& progress) {
  const RayCaster caster({mesh});
  std::vector<std::vector<bool>> visible(views.size());
  ParallelFor(0, int(visible.size()), [&](int view) {
    progress.Check();
    visible[std::size_t(view)] = VisibleFrom(views[std::size_t(view)], mesh, caster);
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

VertexConstraints::VertexConstraints(std::size_t vertices, const std::vector<std::vector<bool>>& visible)
    : begin_(vertices + 1, 0), count_(vertices, 0) {
  for (std::size_t v = 0; v < vertices; ++v) {
    std::size_t views = 0;
    for (const std::vector<bool>& view : visible) views += view[v];
    begin_[v + 1] = begin_[v] + std::min(views, kMost);
  }
  packed_.resize(begin_[vertices]);
}

void VertexConstraints::Add(std::size_t vertex, const AopConstraint& constraint) {
  const std::span<Packed> all(packed_.data() + begin_[vertex], packed_.data() + begin_[vertex + 1]);
  const auto fixed = [](const Eigen::Vector3f& v) {
    std::array<std::int16_t, 3> out;
    for (int k = 0; k < 3; ++k)
      out[std::size_t(k)] = std::int16_t(std::lround(std::clamp(v[k] * kFixed, -32767.f, 32767.f)));
    return out;
  };
  const Packed packed{fixed(constraint.diffuse), fixed(constraint.specular),
                      std::uint16_t(std::lround(65535 * constraint.weight))};
  if (count_[vertex] < all.size()) {
    all[count_[vertex]++] = packed;
  } else if (const auto least = std::ranges::min_element(all, {}, &Packed::weight);
             least != all.end() && least->weight < packed.weight) {
    *least = packed;
  }
}

AopTable VertexConstraints::TableOf(std::size_t vertex) const {
  static_assert(kMost <= AopTable::kMost);
  AopTable table;
  for (std::size_t i = 0; i < count_[vertex]; ++i) {
    const Packed& p = packed_[begin_[vertex] + i];
    const auto loose = [](const std::array<std::int16_t, 3>& v) -> Eigen::Vector3f {
      return Eigen::Vector3f(v[0], v[1], v[2]) / kFixed;
    };
    table.Add({loose(p.diffuse), loose(p.specular), float(p.weight) / 65535});
  }
  table.Pad();
  return table;
}

void AddAopConstraints(const TriangleMesh& mesh, const DenseView& view, const Image<PolarSample>& polar,
                       const std::vector<bool>& visible, VertexConstraints& constraints) {
  const Eigen::Matrix3f world_from_cam = view.cam_from_world.rotation.transpose().cast<float>();
  ParallelFor(0, int(mesh.vertices.size()), [&](int i) {
    const auto vertex = std::size_t(i);
    if (!visible[vertex]) return;
    const Eigen::Vector3d p = view.cam_from_world * mesh.vertices[vertex];
    const Eigen::Vector2d at = view.camera.Project(p);
    const PolarSample sample = SamplePolar(polar, at.x(), at.y());
    if (sample.weight <= 0) return;
    AopConstraint constraint = MakeAopConstraint(sample, float(p.x() / p.z()), float(p.y() / p.z()));
    constraint.diffuse = world_from_cam * constraint.diffuse;
    constraint.specular = world_from_cam * constraint.specular;
    constraints.Add(vertex, constraint);
  });
}

}  // namespace polarscan
