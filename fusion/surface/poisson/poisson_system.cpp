// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/poisson/poisson_system.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "core/conjugate_gradients.h"
#include "core/parallel.h"

namespace polarscan {
namespace {

using Sample = PoissonSample;
constexpr float kScreening = 8;  // more follows the points' noise, less rounds (docs/notes/poisson.md)
constexpr int kMostSteps = 60;
constexpr double kResidual = 1e-2;  // of the linear system, as a share of its right side

// The cubic B-spline, and how it falls from one node to the next: B(t + 1/2) - B(t - 1/2).
float Spline(float t) {
  t = std::abs(t);
  if (t < 1) return 2.f / 3 - t * t * (1 - t / 2);
  return t < 2 ? (2 - t) * (2 - t) * (2 - t) / 6 : 0;
}

float SplineStep(float t) { return Spline(t + 0.5f) - Spline(t - 0.5f); }

// Where a sample lies among the values of a block with those around: its cell's first node there, and the
// weights of the cell's corners.
struct Touch {
  int first;
  std::array<float, 8> weights;
  float screening;
};

constexpr int CornerStep(int corner) {
  return (corner & 1) + SparseGrid::kHaloSide * ((corner >> 1 & 1) + SparseGrid::kHaloSide * (corner >> 2));
}

// Sums go block by block, in their order.
class GridSystem {
 public:
  GridSystem(SparseGrid& grid, const std::vector<Sample>& samples)
      : grid_(grid), touches_(std::size_t(grid.size())), residual_(Size()), inverse_diagonal_(Size()) {
    right_side_ = SumOfBlocks([&](int block) { return Prepare(block, samples); });
  }

  void Solve(const Progress& progress) {
    Iterate at{*this, std::vector<float>(Size()), std::vector<float>(Size()), std::vector<float>(Size())};
    const double size = SumOver([&](std::size_t i) {
      at.direction[i] = inverse_diagonal_[i] * residual_[i];
      return double(at.direction[i]) * residual_[i];
    });
    const double enough = kResidual * kResidual * right_side_;
    ConjugateGradients(at, size, kMostSteps, [&](double left) {
      progress.Check();
      return left > enough;
    });
    SumOver([&](std::size_t i) {
      grid_.Values(0)[i] += at.change[i];
      return 0.0;
    });
  }

 private:
  // What ConjugateGradients asks for.
  struct Iterate {
    GridSystem& system;
    std::vector<float> change, direction, image;

    double Curvature() {
      return system.SumOfBlocks([&](int block) { return system.Apply(block, direction, image); });
    }
    double UpdateSolution(double length) {
      const auto step = float(length);
      std::vector<float>& residual = system.residual_;
      return system.SumOver([&](std::size_t i) {
        change[i] += step * direction[i];
        residual[i] -= step * image[i];
        return double(residual[i]) * system.inverse_diagonal_[i] * residual[i];
      });
    }
    void UpdateDirection(double length) {
      const auto share = float(length);
      system.SumOver([&](std::size_t i) {
        direction[i] = system.inverse_diagonal_[i] * system.residual_[i] + share * direction[i];
        return 0.0;
      });
    }
  };

  std::size_t Size() const { return std::size_t(grid_.size()) * SparseGrid::kNodes; }

  // Of f(block), in parallel.
  template <class F>
  double SumOfBlocks(F&& f) const {
    std::vector<double> parts(std::size_t(grid_.size()));
    ParallelFor(0, grid_.size(), [&](int block) { parts[std::size_t(block)] = f(block); });
    double sum = 0;
    for (const double part : parts) sum += part;
    return sum;
  }

  // Of f(node).
  template <class F>
  double SumOver(F&& f) const {
    return SumOfBlocks([&](int block) {
      double sum = 0;
      for (std::size_t i = std::size_t(block) * SparseGrid::kNodes;
           i < std::size_t(block + 1) * SparseGrid::kNodes; ++i)
        sum += f(i);
      return sum;
    });
  }

  // What the system makes of the values of a block with those around.
  void MatrixTimes(int block, const SparseGrid::Halo& x, float* image) const {
    std::array<float, std::tuple_size_v<SparseGrid::Halo>> screening{};
    for (const Touch& touch : touches_[std::size_t(block)]) {
      float value = 0;
      for (int corner = 0; corner < 8; ++corner)
        value += touch.weights[std::size_t(corner)] * x[std::size_t(touch.first + CornerStep(corner))];
      value *= touch.screening;
      for (int corner = 0; corner < 8; ++corner)
        screening[std::size_t(touch.first + CornerStep(corner))] +=
            touch.weights[std::size_t(corner)] * value;
    }
    for (int node = 0, z = 0; z < SparseGrid::kSide; ++z)
      for (int y = 0; y < SparseGrid::kSide; ++y)
        for (int i = SparseGrid::HaloIndex(0, y, z); i < SparseGrid::HaloIndex(SparseGrid::kSide, y, z);
             ++i, ++node) {
          const auto at = [&x, i](int step) { return x[std::size_t(i + step)]; };
          image[node] = 6 * at(0) - (at(-1) + at(1)) - (at(-kRow) + at(kRow)) - (at(-kLayer) + at(kLayer)) +
                        screening[std::size_t(i)];
        }
  }

  // The product of the values and their image.
  double Apply(int block, const std::vector<float>& values, std::vector<float>& image) const {
    SparseGrid::Halo x;
    grid_.Load(values, block, x);
    const std::size_t begin = std::size_t(block) * SparseGrid::kNodes;
    MatrixTimes(block, x, image.data() + begin);
    double product = 0;
    for (std::size_t i = begin; i < begin + SparseGrid::kNodes; ++i) product += double(values[i]) * image[i];
    return product;
  }

  // Returns the size of the right side.
  double Prepare(int block, const std::vector<Sample>& samples) {
    const SparseGrid::Place place = SparseGrid::PlaceOf(grid_.key(block));
    const Eigen::Vector3i first = SparseGrid::kSide * Eigen::Vector3i(place[0], place[1], place[2]);
    std::vector<Touch>& touches = touches_[std::size_t(block)];
    std::array<float, SparseGrid::kNodes> right{}, diagonal;
    diagonal.fill(6);
    for (int around : grid_.Around(block)) {
      if (around < 0) continue;
      for (const Sample& sample : SamplesOf(samples, grid_.key(around))) {
        const Eigen::Vector3f at = sample.at - first.cast<float>();
        AddNormal(at, sample.normal, right);
        const Eigen::Vector3i cell(int(std::floor(at.x())), int(std::floor(at.y())), int(std::floor(at.z())));
        if (cell.minCoeff() < -1 || cell.maxCoeff() >= SparseGrid::kSide) continue;
        touches.push_back(TouchOf(at - cell.cast<float>(), cell, kScreening * sample.weight));
      }
    }
    for (const Touch& touch : touches)
      for (int corner = 0; corner < 8; ++corner) {
        const int x = touch.first % kRow + (corner & 1) - 1,
                  y = touch.first / kRow % kRow + (corner >> 1 & 1) - 1,
                  z = touch.first / kLayer + (corner >> 2) - 1;
        const float weight = touch.weights[std::size_t(corner)];
        if (std::min({x, y, z}) >= 0 && std::max({x, y, z}) < SparseGrid::kSide)
          diagonal[std::size_t(SparseGrid::LocalIndex(x, y, z))] += touch.screening * weight * weight;
      }
    SparseGrid::Halo x;
    grid_.Load(block, x);
    std::array<float, SparseGrid::kNodes> image;
    MatrixTimes(block, x, image.data());
    const std::size_t begin = std::size_t(block) * SparseGrid::kNodes;
    double right_side = 0;
    for (std::size_t i = 0; i < SparseGrid::kNodes; ++i) {
      residual_[begin + i] = right[i] - image[i];
      inverse_diagonal_[begin + i] = 1 / diagonal[i];
      right_side += double(right[i]) * right[i] / diagonal[i];
    }
    return right_side;
  }

  // Inside is where normals come from: values fall along them.
  static void AddNormal(const Eigen::Vector3f& at, const Eigen::Vector3f& normal,
                        std::array<float, SparseGrid::kNodes>& right) {
    std::array<std::array<float, SparseGrid::kSide>, 3> weight, step;
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < SparseGrid::kSide; ++i) {
        weight[std::size_t(axis)][std::size_t(i)] = Spline(float(i) - at[axis]);
        step[std::size_t(axis)][std::size_t(i)] = normal[axis] * SplineStep(float(i) - at[axis]);
      }
    const auto& [wx, wy, wz] = weight;
    const auto& [sx, sy, sz] = step;
    for (std::size_t z = 0, node = 0; z < SparseGrid::kSide; ++z)
      for (std::size_t y = 0; y < SparseGrid::kSide; ++y)
        for (std::size_t x = 0; x < SparseGrid::kSide; ++x, ++node)
          right[node] += sx[x] * wy[y] * wz[z] + wx[x] * (sy[y] * wz[z] + wy[y] * sz[z]);
  }

  static Touch TouchOf(const Eigen::Vector3f& f, const Eigen::Vector3i& cell, float screening) {
    Touch touch{SparseGrid::HaloIndex(cell.x(), cell.y(), cell.z()), {}, screening};
    for (int corner = 0; corner < 8; ++corner)
      touch.weights[std::size_t(corner)] = ((corner & 1) ? f.x() : 1 - f.x()) *
                                           ((corner & 2) ? f.y() : 1 - f.y()) *
                                           ((corner & 4) ? f.z() : 1 - f.z());
    return touch;
  }

  static constexpr int kRow = SparseGrid::kHaloSide, kLayer = kRow * kRow;
  SparseGrid& grid_;
  std::vector<std::vector<Touch>> touches_;  // of each block
  std::vector<float> residual_, inverse_diagonal_;
  double right_side_;  // its square, in the preconditioner's measure
};

// The values at the nodes of the quadratic B-splines whose coefficients the values are.
void Smooth(SparseGrid& grid) {
  std::vector<float> smooth(std::size_t(grid.size()) * SparseGrid::kNodes);
  ParallelFor(0, grid.size(), [&](int block) {
    SparseGrid::Halo values, along;
    grid.Load(block, values);
    for (int step : {1, SparseGrid::kHaloSide, SparseGrid::kHaloSide * SparseGrid::kHaloSide}) {
      along = values;
      for (std::size_t i = std::size_t(step); i + std::size_t(step) < values.size(); ++i)
        along[i] += (values[i - std::size_t(step)] - 2 * values[i] + values[i + std::size_t(step)]) / 8;
      values = along;
    }
    float* out = smooth.data() + std::size_t(block) * SparseGrid::kNodes;
    for (int z = 0; z < SparseGrid::kSide; ++z)
      for (int y = 0; y < SparseGrid::kSide; ++y, out += SparseGrid::kSide)
        std::copy_n(&values[std::size_t(SparseGrid::HaloIndex(0, y, z))], SparseGrid::kSide, out);
  });
  ParallelFor(0, grid.size(), [&](int block) {
    std::copy_n(smooth.data() + std::size_t(block) * SparseGrid::kNodes, SparseGrid::kNodes,
                grid.Values(block));
  });
}

}  // namespace

void SolvePoisson(SparseGrid& grid, const std::vector<Sample>& samples, const Progress& progress) {
  GridSystem(grid, samples).Solve(progress);
  Smooth(grid);
}

}  // namespace polarscan
