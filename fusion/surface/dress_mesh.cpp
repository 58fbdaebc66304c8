// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/dress_mesh.h"

#include "core/parallel.h"
#include "fusion/surface/nearest_points.h"

namespace polarscan {
namespace {

constexpr int kNearPoints = 6;

// The mean of the nearest points, weighted by 1 / (1 + (distance / cell)^2). Beyond `limit` only the colour.
CloudPoint Dress(const std::vector<NearPoint>& nearest, const std::vector<CloudPoint>& cloud, double cell,
                 double limit) {
  double weights = 0, dop = 0, confidence = 0, views = 0;
  Eigen::Vector3d colour = Eigen::Vector3d::Zero();
  for (const NearPoint& near : nearest) {
    const CloudPoint& p = cloud[near.index];
    const double weight = 1 / (1 + near.distance * near.distance / (cell * cell));
    weights += weight, dop += weight * p.dop, confidence += weight * p.confidence, views += weight * p.views;
    colour += weight * Eigen::Vector3d(p.colour.r, p.colour.g, p.colour.b);
  }
  colour = colour / weights + Eigen::Vector3d::Constant(0.5);
  CloudPoint dressed;
  dressed.colour = {std::uint8_t(colour.x()), std::uint8_t(colour.y()), std::uint8_t(colour.z())};
  if (nearest.front().distance > limit) return dressed;
  dressed.dop = float(dop / weights), dressed.confidence = float(confidence / weights);
  dressed.views = std::uint16_t(views / weights + 0.5);
  return dressed;
}

}  // namespace

SurfaceMesh DressMesh(const TriangleMesh& mesh, const std::vector<CloudPoint>& cloud, double cell,
                      double limit) {
  const auto nearest = NearestPoints(Positions(cloud), mesh.vertices, kNearPoints);
  SurfaceMesh dressed;
  dressed.vertices.resize(mesh.vertices.size()), dressed.triangles = mesh.triangles;
  ParallelFor(0, int(mesh.vertices.size()), [&](int i) {
    const auto v = std::size_t(i);
    dressed.vertices[v] = Dress(nearest[v], cloud, cell, limit);
    dressed.vertices[v].position = mesh.vertices[v].cast<float>();
    dressed.vertices[v].normal = mesh.normals[v].cast<float>();
  });
  return dressed;
}

}  // namespace polarscan
