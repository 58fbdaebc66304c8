// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <vector>

#include "core/mesh.h"
#include "fusion/mesh_topology.h"

namespace polarscan {

// Where a vertex ought to go along its normal (world units), and how much that counts; weight 0: not asked.
struct Pull {
  double move = 0, weight = 0;
};

// What is asked of the vertices of a mesh, by vertex.
struct NormalFit {
  std::vector<Eigen::Matrix3d> normal;  // symmetric, positive semidefinite: a unit normal n costs n^T M n
  std::vector<Pull> pulls;              // with their weights as below
  double smoothness = 0;
};

// The moves d of all vertices along their unit normals, world units, that minimise
//   sum_faces A ((n - G d)^T M (n - G d) + smoothness |G d|^2) + sum_vertices A w (d - pull)^2 / edge^2
// with areas A, the mean edge length, M the mean of the face's vertices, and G d the change of the face's
// normal n for small moves: vertex i takes (n . n_i) times the gradient of its hat function. A sparse linear
// system (conjugate gradients); no vertex moves by more than `edge`. Throws Error if nothing holds the
// surface in place. Same result for any number of threads.
Eigen::VectorXd FitMoves(const TriangleMesh& mesh, const VertexNeighbours& neighbours, const NormalFit& fit);

}  // namespace polarscan
