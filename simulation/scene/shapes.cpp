// SPDX-License-Identifier: Apache-2.0
#include "simulation/scene/shapes.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "simulation/scene/implicit.h"

namespace polarscan {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Union of two solids with a fillet of about k (quadratic polynomial).
double Blend(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - 0.25 * k * h * h;
}
double Carve(double a, double b, double k) { return -Blend(-a, b, k); }

double Ellipsoid(const Vector3d& p, const Vector3d& center, const Vector3d& radii) {
  const Vector3d q = p - center;
  const double k0 = q.cwiseQuotient(radii).norm(), k1 = q.cwiseQuotient(radii.cwiseAbs2()).norm();
  return k1 > 1e-12 ? k0 * (k0 - 1) / k1 : -radii.minCoeff();
}

double Capsule(const Vector3d& p, const Vector3d& a, const Vector3d& b, double ra, double rb) {
  const Vector3d ab = b - a;
  const double t = std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
  return (p - a - t * ab).norm() - std::lerp(ra, rb, t);
}

double Torus(const Vector3d& p, const Vector3d& center, double ring, double tube) {
  const Vector3d q = p - center;
  return Vector2d(Vector2d(q.x(), q.z()).norm() - ring, q.y()).norm() - tube;
}

double BearHead(const Vector3d& p) {
  const Vector3d m(std::abs(p.x()), p.y(), p.z());  // the bear is symmetric
  double d = Ellipsoid(p, {0, 0.98, 0.06}, {0.50, 0.46, 0.45});
  double ear = Ellipsoid(m, {0.38, 1.37, 0.0}, {0.19, 0.20, 0.12});
  ear = Carve(ear, Ellipsoid(m, {0.39, 1.38, 0.14}, {0.11, 0.12, 0.08}), 0.05);
  d = Blend(d, ear, 0.06);
  d = Blend(d, Ellipsoid(p, {0, 0.86, 0.44}, {0.23, 0.18, 0.19}), 0.09);
  d = Blend(d, Ellipsoid(p, {0, 0.95, 0.61}, {0.085, 0.06, 0.06}), 0.02);
  return Blend(d, Ellipsoid(m, {0.185, 1.09, 0.445}, {0.055, 0.065, 0.05}), 0.015);
}

double BearBody(const Vector3d& p) {
  const Vector3d m(std::abs(p.x()), p.y(), p.z());
  double d = Ellipsoid(p, {0, 0.02, 0}, {0.60, 0.72, 0.55});
  d = Blend(d, Capsule(m, {0.47, 0.38, 0.12}, {0.66, -0.08, 0.42}, 0.17, 0.20), 0.08);
  d = Blend(d, Capsule(m, {0.34, -0.48, 0.25}, {0.52, -0.50, 0.80}, 0.24, 0.22), 0.08);
  const double sole = Ellipsoid(m, {0.53, -0.42, 0.90}, {0.23, 0.29, 0.16});
  d = Blend(d, sole, 0.06);
  return Blend(d, Ellipsoid(p, {0, -0.40, -0.58}, {0.17, 0.17, 0.16}), 0.05);
}

double Bear(const Vector3d& p) {
  double d = Blend(BearBody(p), BearHead(p), 0.10);
  const double turn = std::atan2(p.x(), p.z());  // a knitted scarf
  d = Blend(d, Torus(p, {0, 0.60, 0.03}, 0.40, 0.115) + 0.012 * std::cos(40 * turn + 30 * p.y()), 0.02);
  d -= 0.004 * std::sin(21 * p.x()) * std::sin(23 * p.y()) * std::sin(19 * p.z());
  return Carve(d, p.y() + 0.66, 0.06);  // flat below
}

TriangleMesh BearMesh(const Progress& progress) {
  return MeshImplicit(Bear, {Vector3d(-1, -0.9, -1), Vector3d(1, 1.75, 1.3)}, 160, progress);
}

TriangleMesh SphereMesh() {
  const Implicit sphere = [](const Vector3d& p) { return p.norm() - 1; };
  return MeshImplicit(sphere, {Vector3d::Constant(-1.05), Vector3d::Constant(1.05)}, 80);
}

// Triangles of a surface over (u, v) in [0, 1]^2; both ways closed. Outward if d/du x d/dv points outward.
TriangleMesh ClosedSurface(int u_count, int v_count, const std::function<Vector3d(double, double)>& point) {
  TriangleMesh mesh;
  for (int i = 0; i < u_count; ++i)
    for (int j = 0; j < v_count; ++j)
      mesh.vertices.push_back(point(double(i) / u_count, double(j) / v_count));
  const auto id = [&](int i, int j) { return std::uint32_t((i % u_count) * v_count + j % v_count); };
  for (int i = 0; i < u_count; ++i)
    for (int j = 0; j < v_count; ++j) {
      mesh.triangles.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
      mesh.triangles.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
    }
  ComputeVertexNormals(mesh);
  return mesh;
}

Vector3d KnotCurve(double t) {
  const double a = 2 * std::numbers::pi * t;
  return {std::sin(a) + 2 * std::sin(2 * a), std::cos(a) - 2 * std::cos(2 * a), -1.15 * std::sin(3 * a)};
}

// A tube around a trefoil; a slight twist of its section makes it less of a pipe.
TriangleMesh KnotMesh() {
  return ClosedSurface(800, 100, [](double s, double t) {
    const Vector3d along = (KnotCurve(s + 1e-4) - KnotCurve(s - 1e-4)).normalized();
    const Vector3d right = along.cross(Vector3d::UnitZ()).normalized(), up = right.cross(along);
    const double turn = 2 * std::numbers::pi * t,
                 section = 0.50 + 0.035 * std::cos(3 * turn + 18 * std::numbers::pi * s);
    return Vector3d(KnotCurve(s) + section * (std::cos(turn) * right + std::sin(turn) * up));
  });
}

// Profile of the vase, (radius, height) over t: bottom, belly, neck, lip, and down again inside
// (Catmull-Rom).
Vector2d VaseProfile(double t) {
  static const std::vector<Vector2d> kPoints = {
      {0.001, 0.00}, {0.30, 0.00}, {0.46, 0.01}, {0.52, 0.06}, {0.66, 0.35}, {0.84, 0.75}, {0.88, 1.10},
      {0.72, 1.50},  {0.46, 1.80}, {0.36, 2.00}, {0.37, 2.16}, {0.50, 2.34}, {0.54, 2.39}, {0.51, 2.42},
      {0.44, 2.36},  {0.30, 2.16}, {0.29, 1.98}, {0.38, 1.76}, {0.60, 1.45}, {0.62, 1.20}, {0.001, 1.10}};
  const double x = t * double(kPoints.size() - 1);
  const int i = std::min(int(x), int(kPoints.size()) - 2);
  const double f = x - i;
  const auto at = [&](int k) { return kPoints[std::size_t(std::clamp(k, 0, int(kPoints.size()) - 1))]; };
  const Vector2d a = at(i - 1), b = at(i), c = at(i + 1), d = at(i + 2);
  return 0.5 *
         (2 * b + f * (c - a) + f * f * (2 * a - 5 * b + 4 * c - d) + f * f * f * (3 * b - a - 3 * c + d));
}

// Twisted flutes on the belly, rings on the neck; the inside stays plain.
double VaseRelief(double height, double turn) {
  const double belly = std::exp(-std::pow((height - 0.85) / 0.42, 4)),
               neck = std::exp(-std::pow((height - 1.9) / 0.2, 2));
  return 0.030 * belly * std::cos(18 * turn + 5 * height) + 0.010 * neck * std::cos(60 * height);
}

TriangleMesh VaseMesh() {
  const int rows = 360, columns = 400;
  TriangleMesh mesh;
  for (int i = 0; i <= rows; ++i)
    for (int j = 0; j < columns; ++j) {
      const double t = double(i) / rows, turn = 2 * std::numbers::pi * j / columns;
      Vector2d p = VaseProfile(t);
      if (t < 0.6) p.x() += VaseRelief(p.y(), turn);
      mesh.vertices.emplace_back(p.x() * std::sin(turn), p.y(), p.x() * std::cos(turn));
    }
  const auto id = [](int i, int j) { return std::uint32_t(i * columns + j % columns); };
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      mesh.triangles.push_back({id(i, j), id(i, j + 1), id(i + 1, j + 1)});
      mesh.triangles.push_back({id(i, j), id(i + 1, j + 1), id(i + 1, j)});
    }
  ComputeVertexNormals(mesh);
  return mesh;
}

// Center of the smallest enclosing sphere: step towards the farthest point by 1/(i+1).
Vector3d EnclosingCenter(const std::vector<Vector3d>& points) {
  Vector3d center = Vector3d::Zero();
  for (const Vector3d& p : points) center += p / double(points.size());
  for (int i = 1; i < 300; ++i) {
    const auto farthest =
        std::max_element(points.begin(), points.end(), [&](const Vector3d& a, const Vector3d& b) {
          return (a - center).squaredNorm() < (b - center).squaredNorm();
        });
    center += (*farthest - center) / (i + 1);
  }
  return center;
}

void DropUnusedVertices(TriangleMesh& mesh) {
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> new_index(mesh.vertices.size(), kUnused);
  TriangleMesh kept;
  for (auto triangle : mesh.triangles) {
    for (std::uint32_t& i : triangle) {
      if (new_index[i] == kUnused) {
        new_index[i] = std::uint32_t(kept.vertices.size());
        kept.vertices.push_back(mesh.vertices[i]);
        kept.normals.push_back(mesh.normals[i]);
      }
      i = new_index[i];
    }
    kept.triangles.push_back(triangle);
  }
  mesh = std::move(kept);
}

}  // namespace

TriangleMesh NamedShape(const std::string& name, const Progress& progress) {
  if (name == "bear") return BearMesh(progress);
  if (name == "vase") return VaseMesh();
  if (name == "knot") return KnotMesh();
  if (name == "sphere") return SphereMesh();
  throw Error("no such scene", name, "Try 'bear', 'vase', 'knot' or 'sphere', or give a mesh");
}

std::vector<std::string> ShapeNames() { return {"bear", "vase", "knot", "sphere"}; }

void Normalize(TriangleMesh& mesh) {
  DropUnusedVertices(mesh);
  if (mesh.vertices.empty()) throw Error("an object without triangles", "the mesh");
  const Vector3d center = EnclosingCenter(mesh.vertices);
  double radius = 0;
  for (const Vector3d& v : mesh.vertices) radius = std::max(radius, (v - center).norm());
  if (!(radius > 0)) throw Error("an object without extent", "the mesh");
  for (Vector3d& v : mesh.vertices) v = (v - center) / radius;
}

}  // namespace polarscan
