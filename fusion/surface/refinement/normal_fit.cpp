// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/refinement/normal_fit.h"

#include <Eigen/Dense>
#include <algorithm>

#include "core/conjugate_gradients.h"
#include "core/error.h"
#include "core/parallel.h"

namespace polarscan {
namespace {

constexpr double kTolerance = 0.01;  // of the residual to the right-hand side; 1e-4 changes no digit
constexpr int kMostIterations = 10'000;

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

// What a face asks of its three vertices.
struct FaceSystem {
  Eigen::Matrix3f matrix;
  Eigen::Vector3f target;
  float area = 0;
};

FaceSystem MakeFaceSystem(const TriangleMesh& mesh, const NormalFit& fit, const Triangle& t) {
  const Face face = MakeFace(mesh, t);
  const Eigen::Matrix3d normal = (fit.normal[t[0]] + fit.normal[t[1]] + fit.normal[t[2]]) / 3;
  const Eigen::Matrix3d smooth = fit.smoothness * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d weighted = face.area * face.slopes.transpose();
  return {(weighted * (normal + smooth) * face.slopes).cast<float>(),
          (weighted * (normal * face.normal)).cast<float>(), float(face.area)};
}

// A symmetric matrix with an entry for each vertex and each pair of neighbours, and a right-hand side. Single
// precision suffices for what waits for memory.
class VertexSystem {
 public:
  VertexSystem(const VertexNeighbours& neighbours, std::size_t vertices)
      : right(Eigen::VectorXd::Zero(Eigen::Index(vertices))),
        neighbours_(neighbours),
        diagonal_(right),
        beside_(neighbours.Begin(vertices), 0) {}

  Eigen::VectorXd right;

  // One row at a time, from any thread.
  void Add(std::uint32_t row, std::uint32_t column, double value) {
    if (row == column) {
      diagonal_[row] += value;
      return;
    }
    const auto around = neighbours_.Of(row);
    const auto place = std::ranges::lower_bound(around, column) - around.begin();
    beside_[neighbours_.Begin(row) + std::size_t(place)] += float(value);
  }

  // By conjugate gradients with the diagonal as preconditioner (Saad, Iterative Methods, 9.2), from zero.
  // Throws Error if they do not end.
  Eigen::VectorXd Solve() const {
    Iterate at{*this,
               Eigen::VectorXd::Zero(right.size()),
               right,
               right.cwiseQuotient(diagonal_),
               Eigen::VectorXd(right.size()),
               right.squaredNorm()};
    const double enough = kTolerance * kTolerance * at.left;
    ConjugateGradients(at, at.residual.dot(at.direction), kMostIterations,
                       [&](double) { return at.left > enough; });
    if (!(at.left <= enough))
      throw Error("the mesh cannot be refined", std::to_string(right.size()) + " vertices",
                  "Try --no-refine");
    return std::move(at.x);
  }

 private:
  using Pair = Eigen::Vector2d;

  // What ConjugateGradients asks for. left: the residual's square.
  struct Iterate {
    const VertexSystem& system;
    Eigen::VectorXd x, residual, direction, product;
    double left;

    double Curvature() {
      return system.SumOfBlocks([&](Eigen::Index begin, Eigen::Index count) {
        system.Multiply(direction, begin, count, product);
        return Pair(direction.segment(begin, count).dot(product.segment(begin, count)), 0);
      })[0];
    }
    double UpdateSolution(double length) {
      const Pair sums = system.SumOfBlocks([&](Eigen::Index begin, Eigen::Index count) {
        auto rest = residual.segment(begin, count);
        x.segment(begin, count) += length * direction.segment(begin, count);
        rest -= length * product.segment(begin, count);
        return Pair(rest.dot(rest.cwiseQuotient(system.diagonal_.segment(begin, count))), rest.squaredNorm());
      });
      left = sums[1];
      return sums[0];
    }
    void UpdateDirection(double share) {
      system.SumOfBlocks([&](Eigen::Index begin, Eigen::Index count) {
        auto part = direction.segment(begin, count);
        part = residual.segment(begin, count).cwiseQuotient(system.diagonal_.segment(begin, count)) +
               share * part;
        return Pair(0, 0);
      });
    }
  };

  // Of f(begin, count), in parallel; blocks do not depend on the number of threads.
  template <class F>
  Pair SumOfBlocks(const F& f) const {
    constexpr Eigen::Index kBlock = 4096;
    std::vector<Pair> sums(std::size_t((right.size() + kBlock - 1) / kBlock));
    ParallelFor(0, int(sums.size()), [&](int i) {
      const Eigen::Index begin = i * kBlock;
      sums[std::size_t(i)] = f(begin, std::min(kBlock, right.size() - begin));
    });
    Pair sum(0, 0);
    for (const Pair& s : sums) sum += s;
    return sum;
  }

  void Multiply(const Eigen::VectorXd& x, Eigen::Index begin, Eigen::Index count,
                Eigen::VectorXd& out) const {
    for (Eigen::Index row = begin; row < begin + count; ++row) {
      double sum = diagonal_[row] * x[row];
      const float* value = beside_.data() + neighbours_.Begin(std::size_t(row));
      for (std::uint32_t column : neighbours_.Of(std::size_t(row))) sum += double(*value++) * x[column];
      out[row] = sum;
    }
  }

  const VertexNeighbours& neighbours_;
  Eigen::VectorXd diagonal_;
  std::vector<float> beside_;
};

}  // namespace

Eigen::VectorXd FitMoves(const TriangleMesh& mesh, const VertexNeighbours& neighbours, const NormalFit& fit) {
  const std::size_t count = mesh.vertices.size();
  std::vector<FaceSystem> faces(mesh.triangles.size());
  ParallelFor(0, int(faces.size()), [&](int i) {
    faces[std::size_t(i)] = MakeFaceSystem(mesh, fit, mesh.triangles[std::size_t(i)]);
  });
  VertexSystem system(neighbours, count);
  const double edge = MeanEdge(mesh);
  ParallelFor(0, int(count), [&](int row) {
    const auto v = std::uint32_t(row);
    double area = 0;
    for (std::uint32_t f : neighbours.TrianglesOf(v)) {
      const Triangle& t = mesh.triangles[f];
      const auto i = std::ranges::find(t, v) - t.begin();
      system.right[row] += double(faces[f].target[i]), area += double(faces[f].area) / 3;
      for (int j = 0; j < 3; ++j) system.Add(v, t[std::size_t(j)], double(faces[f].matrix(i, j)));
    }
    const Pull& pull = fit.pulls[v];
    const double strength = pull.weight * std::max(area / (edge * edge), 1e-3);
    system.Add(v, v, strength);
    system.right[row] += strength * pull.move;
  });
  return system.Solve().cwiseMax(-edge).cwiseMin(edge);
}

}  // namespace polarscan
