// SPDX-License-Identifier: Apache-2.0
#include "fusion/normal_fit.h"

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <algorithm>

#include "core/error.h"
#include "fusion/mesh_topology.h"

namespace polarscan {
namespace {

constexpr double kTolerance =
    0.01;  // of the residual to the right-hand side; 1e-4 changes no digit of the errors

// A face's normal, its area, and how the normal falls (column i) as vertex i moves along its own normal by 1.
struct Face {
  Eigen::Vector3d normal;
  double area = 0;
  Eigen::Matrix3d slopes;
};

Face MakeFace(const TriangleMesh& mesh, const Triangle& t) {
  const Eigen::Vector3d &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
  Face face{(b - a).cross(c - a), 0, Eigen::Matrix3d::Zero()};
  face.area = face.normal.norm() / 2;
  if (face.area <= 0) return face;
  face.normal /= 2 * face.area;
  face.slopes << face.normal.cross(c - b), face.normal.cross(a - c), face.normal.cross(b - a);
  for (int i = 0; i < 3; ++i)
    face.slopes.col(i) *= face.normal.dot(mesh.normals[t[std::size_t(i)]]) / (2 * face.area);
  return face;
}

}  // namespace

Eigen::VectorXd FitMoves(const TriangleMesh& mesh, const NormalFit& fit) {
  const auto count = Eigen::Index(mesh.vertices.size());
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(9 * mesh.triangles.size() + mesh.vertices.size());
  Eigen::VectorXd right = Eigen::VectorXd::Zero(count), areas = Eigen::VectorXd::Zero(count);
  for (const Triangle& t : mesh.triangles) {
    const Face face = MakeFace(mesh, t);
    const Eigen::Matrix3d matrix = (fit.normal[t[0]] + fit.normal[t[1]] + fit.normal[t[2]]) / 3;
    const Eigen::Matrix3d smooth = fit.smoothness * Eigen::Matrix3d::Identity();
    const Eigen::Matrix3d system = face.area * face.slopes.transpose() * (matrix + smooth) * face.slopes;
    const Eigen::Vector3d target = face.area * face.slopes.transpose() * (matrix * face.normal);
    for (int i = 0; i < 3; ++i) {
      const auto row = t[std::size_t(i)];
      right[row] += target[i], areas[row] += face.area / 3;
      for (int j = 0; j < 3; ++j) entries.emplace_back(int(row), int(t[std::size_t(j)]), system(i, j));
    }
  }
  const double edge = MeanEdge(mesh);
  for (Eigen::Index v = 0; v < count; ++v) {
    const Pull& pull = fit.pulls[std::size_t(v)];
    const double strength = pull.weight * std::max(areas[v] / (edge * edge), 1e-3);
    entries.emplace_back(int(v), int(v), strength);
    right[v] += strength * pull.move;
  }
  Eigen::SparseMatrix<double> system(count, count);
  system.setFromTriplets(entries.begin(), entries.end());
  Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper> solver(system);
  solver.setTolerance(kTolerance);
  const Eigen::VectorXd moves = solver.solve(right);
  if (solver.info() != Eigen::Success || !moves.allFinite())
    throw Error("the mesh cannot be refined", std::to_string(count) + " vertices", "Try --no-refine");
  return moves.cwiseMax(-edge).cwiseMin(edge);
}

}  // namespace polarscan
