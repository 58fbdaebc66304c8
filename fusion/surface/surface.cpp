// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/random.h"

namespace polarscan {
namespace {

struct Corners {
  Eigen::Vector3d a, b, c;
  Eigen::Vector3d Cross() const { return (b - a).cross(c - a); }  // twice the area, outward
};

Corners CornersOf(const TriangleMesh& mesh, std::size_t triangle) {
  const auto& t = mesh.triangles[triangle];
  return {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
}

std::vector<double> CumulativeAreas(const TriangleMesh& mesh) {
  std::vector<double> areas;
  areas.reserve(mesh.triangles.size());
  double sum = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    areas.push_back(sum += CornersOf(mesh, i).Cross().norm() / 2);
  return areas;
}

// Uniform in the triangle: points of the parallelogram's other half are turned back.
SurfaceSample SampleTriangle(const Corners& t, double u, double v) {
  if (u + v > 1) u = 1 - u, v = 1 - v;
  return {t.a + u * (t.b - t.a) + v * (t.c - t.a), t.Cross().normalized()};
}

}  // namespace

double SurfaceArea(const TriangleMesh& mesh) {
  const std::vector<double> areas = CumulativeAreas(mesh);
  return areas.empty() ? 0 : areas.back();
}

std::vector<SurfaceSample> SampleSurface(const TriangleMesh& mesh, int count, std::uint64_t seed) {
  const std::vector<double> areas = CumulativeAreas(mesh);
  if (areas.empty() || !(areas.back() > 0)) throw Error("the mesh has no area", "surface samples");
  std::vector<SurfaceSample> samples;
  samples.reserve(std::size_t(count));
  for (int i = 0; i < count; ++i) {
    Random random(seed, std::uint64_t(i));
    const auto found = std::ranges::upper_bound(areas, random.Uniform() * areas.back());
    const auto triangle = std::min<std::size_t>(std::size_t(found - areas.begin()), areas.size() - 1);
    const double u = random.Uniform(), v = random.Uniform();
    samples.push_back(SampleTriangle(CornersOf(mesh, triangle), u, v));
  }
  return samples;
}

double BoundingRadius(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : mesh.vertices) box.extend(v);
  double radius = 0;
  for (const Eigen::Vector3d& v : mesh.vertices) radius = std::max(radius, (v - box.center()).norm());
  return radius;
}

}  // namespace polarscan
