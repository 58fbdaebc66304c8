// SPDX-License-Identifier: Apache-2.0
#include "stereo/contours/fit_distances.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/conjugate_gradients.h"
#include "core/parallel.h"
#include "stereo/contours/fill.h"

namespace polarscan {
namespace {

// Planes have a border of one pixel in which every weight is 0, so that no loop asks whether a neighbour is there.
// A cell lies between four pixels and has the index of its upper left one.
using Plane = Image<float>;

// The sum of squares at one linearisation: its weights, and its matrix's product.
class DistanceSystem {
 public:
  DistanceSystem(const Problem& problem, const Distances& given, const ContourField* field,
                 const FitOptions& options)
      : options_(options), width_(given.u.width() + 2), height_(given.u.height() + 2) {
    const Plane start = FillFromCoarse(given);
    ForRows([&](int y) { SetPixels(problem, given, start, y); });
    if (field) ForRows([&](int y) { SetContours(*field, y); });
  }

  // Weights from the residuals of the present u; lenience: what outliers and edges are multiplied by.
  void Reweight(float lenience) {
    ForRows([&](int y) { SetWeights(y, lenience); });
    ForRows([&](int y) { SetInverse(y); });
  }

  void Solve(const Progress& progress) {
    const double size = Start();
    ConjugateGradients(*this, size, options_.iterations, [&](double left) {
      progress.Check();
      return left > 1e-10 * size;
    });
  }

  Image<float> Solution() const { return Cropped(u_, 1, 1, width_ - 2, height_ - 2); }

  // What ConjugateGradients asks for.
  double Curvature() {
    Multiply(direction_);
    return SumRows([&](int x, int y) { return direction_(x, y) * product_(x, y); });
  }
  double UpdateSolution(double length) {
    return SumRows([&](int x, int y) {
      u_(x, y) += float(length) * direction_(x, y);
      residual_(x, y) -= float(length) * product_(x, y);
      return residual_(x, y) * residual_(x, y) * inverse_(x, y);
    });
  }
  void UpdateDirection(double share) {
    ForRows([&](int y) {
      for (int x = 1; x < width_ - 1; ++x)
        direction_(x, y) = residual_(x, y) * inverse_(x, y) + float(share) * direction_(x, y);
    });
  }

 private:
  Plane NewPlane() const { return Plane(width_, height_); }

  template <class F>
  void ForRows(F&& f) const {
    ParallelFor(1, height_ - 1, f);
  }

  // Of f(x, y), in an order that does not depend on the threads.
  template <class F>
  double SumRows(F&& f) const {
    std::vector<double> rows(std::size_t(height_), 0.0);
    ForRows([&](int y) {
      for (int x = 1; x < width_ - 1; ++x) rows[std::size_t(y)] += double(f(x, y));
    });
    double sum = 0;
    for (const double row : rows) sum += row;
    return sum;
  }

  void SetPixels(const Problem& problem, const Distances& given, const Plane& start, int y) {
    for (int x = 1; x < width_ - 1; ++x) {
      if (!problem.Active(x - 1, y - 1)) continue;
      active_(x, y) = 1;
      u_(x, y) = start(x - 1, y - 1);
      given_(x, y) = given.u(x - 1, y - 1);
      trust_(x, y) = given.weight(x - 1, y - 1);
    }
  }

  bool WholeCell(int x, int y) const {
    return active_(x, y) && active_(x + 1, y) && active_(x, y + 1) && active_(x + 1, y + 1);
  }

  void SetContours(const ContourField& field, int y) {
    for (int x = 1; x < width_ - 1; ++x) {
      const Eigen::Vector2f doubled = field.At({float(x) - 0.5f, float(y) - 0.5f});
      if (!WholeCell(x, y) || !(doubled.squaredNorm() > 0)) continue;
      const Eigen::Vector2f along = std::sqrt(doubled.norm()) * ContourField::Direction(doubled);
      contour_x_(x, y) = along.x(), contour_y_(x, y) = along.y();
    }
  }

  static float BendX(const Plane& u, int x, int y) { return u(x - 1, y) - 2 * u(x, y) + u(x + 1, y); }
  static float BendY(const Plane& u, int x, int y) { return u(x, y - 1) - 2 * u(x, y) + u(x, y + 1); }
  static float Twist(const Plane& u, int x, int y) {
    return u(x, y) - u(x + 1, y) - u(x, y + 1) + u(x + 1, y + 1);
  }
  float AlongContour(const Plane& u, int x, int y) const {
    const float up = u(x + 1, y) - u(x, y), low = u(x + 1, y + 1) - u(x, y + 1);
    const float left = u(x, y + 1) - u(x, y), right = u(x + 1, y + 1) - u(x + 1, y);
    return (contour_x_(x, y) * (up + low) + contour_y_(x, y) * (left + right)) / 2;
  }

  void SetWeights(int y, float lenience) {
    const auto weigh = [&](float bend) {
      const float share = bend / (lenience * options_.edge_bend);
      return options_.bend / (1 + share * share);
    };
    for (int x = 1; x < width_ - 1; ++x) {
      if (!active_(x, y)) continue;
      const float off = (u_(x, y) - given_(x, y)) / (lenience * options_.outlier_px);
      data_(x, y) = trust_(x, y) / ((1 + off * off) * (1 + off * off));
      if (active_(x - 1, y) && active_(x + 1, y)) bend_x_(x, y) = weigh(BendX(u_, x, y));
      if (active_(x, y - 1) && active_(x, y + 1)) bend_y_(x, y) = weigh(BendY(u_, x, y));
      const float slope = AlongContour(u_, x, y) / (lenience * options_.wrong_slope);
      contour_(x, y) = options_.contour / ((1 + slope * slope) * (1 + slope * slope));
      if (WholeCell(x, y)) twist_(x, y) = 2 * weigh(Twist(u_, x, y));
    }
  }

  void SetInverse(int y) {
    for (int x = 1; x < width_ - 1; ++x) {
      if (!active_(x, y)) continue;
      float diagonal = 1e-6f + data_(x, y) + 4 * (bend_x_(x, y) + bend_y_(x, y)) + bend_x_(x - 1, y) +
                       bend_x_(x + 1, y) + bend_y_(x, y - 1) + bend_y_(x, y + 1);
      for (int v = y - 1; v <= y; ++v)
        for (int u = x - 1; u <= x; ++u) {
          const float sign = (u == x) == (v == y) ? 1 : -1;  // of the cell's own corner and the opposite one
          const float slope = (contour_x_(u, v) + sign * contour_y_(u, v)) / 2;
          diagonal += twist_(u, v) + contour_(u, v) * slope * slope;
        }
      inverse_(x, y) = 1 / diagonal;
    }
  }

  // product = matrix v: first what every second difference and slope of v pulls with, then who is pulled.
  void Multiply(const Plane& v) {
    ForRows([&](int y) {
      for (int x = 1; x < width_ - 1; ++x) {
        pull_x_(x, y) = bend_x_(x, y) * BendX(v, x, y);
        pull_y_(x, y) = bend_y_(x, y) * BendY(v, x, y);
        pull_twist_(x, y) = twist_(x, y) * Twist(v, x, y);
        pull_contour_(x, y) = contour_(x, y) * AlongContour(v, x, y) / 2;
      }
    });
    ForRows([&](int y) {
      for (int x = 1; x < width_ - 1; ++x)
        if (active_(x, y))
          product_(x, y) =
              data_(x, y) * v(x, y) + BendX(pull_x_, x, y) + BendY(pull_y_, x, y) + FromCells(x, y);
    });
  }

  float FromCells(int x, int y) const {
    const float twist =
        pull_twist_(x, y) - pull_twist_(x - 1, y) - pull_twist_(x, y - 1) + pull_twist_(x - 1, y - 1);
    const auto pull = [&](int u, int v, float sign_x, float sign_y) {
      return pull_contour_(u, v) * (sign_x * contour_x_(u, v) + sign_y * contour_y_(u, v));
    };
    return twist + pull(x, y, -1, -1) + pull(x - 1, y, 1, -1) + pull(x, y - 1, -1, 1) +
           pull(x - 1, y - 1, 1, 1);
  }

  // Residual and direction of the present u.
  double Start() {
    Multiply(u_);
    return SumRows([&](int x, int y) {
      residual_(x, y) = active_(x, y) ? data_(x, y) * given_(x, y) - product_(x, y) : 0;
      direction_(x, y) = residual_(x, y) * inverse_(x, y);
      return residual_(x, y) * direction_(x, y);
    });
  }

  const FitOptions& options_;
  const int width_, height_;
  Image<std::uint8_t> active_ = {width_, height_};
  Plane given_ = NewPlane(), trust_ = NewPlane();
  Plane contour_x_ = NewPlane(), contour_y_ = NewPlane();  // of cells: unit direction times root of the field
  // Weights, and the diagonal's inverse.
  Plane data_ = NewPlane(), contour_ = NewPlane(), bend_x_ = NewPlane(), bend_y_ = NewPlane(),
        twist_ = NewPlane(), inverse_ = NewPlane();
  // Of conjugate gradients.
  Plane u_ = NewPlane(), residual_ = NewPlane(), direction_ = NewPlane(), product_ = NewPlane();
  // Between the two passes of Multiply.
  Plane pull_x_ = NewPlane(), pull_y_ = NewPlane(), pull_twist_ = NewPlane(), pull_contour_ = NewPlane();
};

}  // namespace

Image<float> FitDistances(const Problem& problem, const Distances& given, const ContourField* field,
                          const FitOptions& options, const Progress& progress) {
  if (std::ranges::none_of(given.weight.pixels(), [](float weight) { return weight > 0; })) return {};
  DistanceSystem system(problem, given, field, options);
  for (float lenience = options.lenience; lenience >= 1; lenience /= 4) {
    system.Reweight(lenience);
    system.Solve(progress);
  }
  return system.Solution();
}

}  // namespace polarscan
