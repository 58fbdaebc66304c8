// SPDX-License-Identifier: Apache-2.0
#include "stereo/rounds/integrate.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/conjugate_gradients.h"
#include "core/parallel.h"

namespace polarscan {
namespace {

constexpr int kLanes = 8;  // of the loops over a row, which the compiler turns into vectors

// Planes hold the rectangle around the pixels that have a depth, with a border in which every weight is 0:
// so no loop needs to ask whether a neighbour is there.
struct Rectangle {
  int left = 0, top = 0, columns = 0, rows = 0;
  int stride() const { return (columns + 2 + kLanes - 1) / kLanes * kLanes; }
};

Rectangle Around(const Image<float>& depth) {
  int left = depth.width(), right = -1, top = depth.height(), bottom = -1;
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x)
      if (depth(x, y) > 0) {
        left = std::min(left, x), right = std::max(right, x);
        top = std::min(top, y), bottom = std::max(bottom, y);
      }
  return {left, top, std::max(0, right + 1 - left), std::max(0, bottom + 1 - top)};
}

// Row -1 and column -1 are part of the border.
class Bordered {
 public:
  explicit Bordered(const Rectangle& r)
      : stride_(r.stride()), values_(std::size_t(stride_) * std::size_t(r.rows + 2) + 2 * kLanes) {}
  float* Row(int y) { return values_.data() + kLanes + std::ptrdiff_t(stride_) * (y + 1); }
  const float* Row(int y) const { return values_.data() + kLanes + std::ptrdiff_t(stride_) * (y + 1); }

 private:
  int stride_;
  std::vector<float> values_;
};

class Integrator {
 public:
  Integrator(const Pinhole& camera, const Image<float>& depth, const Image<float>& confidence,
             const Image<Eigen::Vector3f>& normals, const IntegrationOptions& options)
      : camera_(camera),
        depth_(depth),
        normals_(normals),
        options_(options),
        area_(Around(depth)),
        voted_(area_),
        data_(area_),
        slope_x_(area_),
        slope_y_(area_),
        right_(area_),
        down_(area_),
        inverse_(area_) {
    ForRows([&](int y) { SetPixels(y, confidence); });
    ForRows([&](int y) { SetLinks(y); });
    ForRows([&](int y) {
      const float *data = data_.Row(y), *right = right_.Row(y), *down = down_.Row(y), *up = down_.Row(y - 1);
      float* inverse = inverse_.Row(y);
      for (int i = 0; i < area_.columns; ++i)
        if (data[i] > 0) inverse[i] = 1 / (data[i] + right[i] + right[i - 1] + down[i] + up[i]);
    });
  }

  Image<float> Solve(const Image<float>& start) {
    Iterate at{*this, Bordered(area_), Bordered(area_), Bordered(area_), Bordered(area_)};
    // Relative to the voted depths, so that a good start is not asked for more.
    const double enough =
        Residuals(voted_, at.residual, at.direction) * options_.tolerance * options_.tolerance;
    ForRows([&](int y) {
      for (int i = 0; i < area_.columns; ++i) {
        const float depth = start(area_.left + i, area_.top + y);
        at.solution.Row(y)[i] = data_.Row(y)[i] > 0 && depth > 0 ? std::log(depth) : voted_.Row(y)[i];
      }
    });
    ConjugateGradients(at, Residuals(at.solution, at.residual, at.direction), options_.iterations,
                       [&](double error) { return error > enough; });
    Image<float> depth(depth_.width(), depth_.height());
    ForRows([&](int y) {
      for (int i = 0; i < area_.columns; ++i)
        if (data_.Row(y)[i] > 0) depth(area_.left + i, area_.top + y) = std::exp(at.solution.Row(y)[i]);
    });
    return depth;
  }

 private:
  // What ConjugateGradients asks for.
  struct Iterate {
    const Integrator& system;
    Bordered solution, residual, direction, product;
    double Curvature() { return system.Multiply(direction, product); }
    double UpdateSolution(double length) {
      return system.Step(float(length), direction, product, solution, residual);
    }
    void UpdateDirection(double share) { system.SetDirection(float(share), residual, direction); }
  };

  template <class F>
  void ForRows(F&& f) const {
    ParallelFor(0, area_.rows, f);
  }

  // Sum over all pixels in an order that does not depend on the threads; f(y, lanes) adds its row's.
  template <class F>
  double SumRows(F&& f) const {
    std::vector<double> rows(std::size_t(area_.rows), 0.0);
    ForRows([&](int y) {
      float lanes[kLanes] = {};
      f(y, lanes);
      for (const float lane : lanes) rows[std::size_t(y)] += double(lane);
    });
    double sum = 0;
    for (const double row : rows) sum += row;
    return sum;
  }

  void SetPixels(int y, const Image<float>& confidence) {
    for (int i = 0; i < area_.columns; ++i) {
      const int px = area_.left + i, py = area_.top + y;
      if (depth_(px, py) <= 0) continue;
      voted_.Row(y)[i] = std::log(depth_(px, py));
      data_.Row(y)[i] = 1e-6f + options_.data_weight * std::min(confidence(px, py), options_.max_confidence);
      const Eigen::Vector3f ray = camera_.Ray(px + 0.5, py + 0.5).cast<float>();
      const Eigen::Vector3f& n = normals_(px, py);
      const float facing = std::min(n.dot(ray), -0.05f);
      slope_x_.Row(y)[i] = -n.x() / (float(camera_.fx) * facing);
      slope_y_.Row(y)[i] = -n.y() / (float(camera_.fy) * facing);
    }
  }

  void SetLinks(int y) {
    for (int i = 0; i < area_.columns; ++i) {
      if (data_.Row(y)[i] <= 0) continue;
      if (data_.Row(y)[i + 1] > 0)
        right_.Row(y)[i] = LinkWeight(i, y, 1, 0, slope_x_.Row(y)[i], slope_x_.Row(y)[i + 1]);
      if (data_.Row(y + 1)[i] > 0)
        down_.Row(y)[i] = LinkWeight(i, y, 0, 1, slope_y_.Row(y)[i], slope_y_.Row(y + 1)[i]);
    }
  }

  float LinkWeight(int i, int y, int dx, int dy, float slope, float slope_there) const {
    const float change = voted_.Row(y + dy)[i + dx] - voted_.Row(y)[i];
    const float misfit = (change - 0.5f * (slope + slope_there)) * float(camera_.fx) / 2;
    const int px = area_.left + i, py = area_.top + y;
    const float jump = (normals_(px + dx, py + dy) - normals_(px, py)).norm() / options_.normal_jump;
    return std::max(1 / ((1 + misfit * misfit) * (1 + misfit * misfit) * (1 + jump * jump)), 1e-4f);
  }

  // Of the estimate w; direction: over the diagonal. Returns their product.
  double Residuals(const Bordered& w, Bordered& residual, Bordered& direction) const {
    return SumRows([&](int y, float* lanes) {
      const float *here = w.Row(y), *below = w.Row(y + 1), *above = w.Row(y - 1);
      const float *right = right_.Row(y), *down = down_.Row(y), *up = down_.Row(y - 1);
      const float *sx = slope_x_.Row(y), *sy = slope_y_.Row(y), *sy_below = slope_y_.Row(y + 1),
                  *sy_above = slope_y_.Row(y - 1);
      for (int i = 0; i < area_.columns; ++i) {
        const float r = data_.Row(y)[i] * (voted_.Row(y)[i] - here[i]) +
                        right[i] * (here[i + 1] - here[i] - 0.5f * (sx[i] + sx[i + 1])) -
                        right[i - 1] * (here[i] - here[i - 1] - 0.5f * (sx[i] + sx[i - 1])) +
                        down[i] * (below[i] - here[i] - 0.5f * (sy[i] + sy_below[i])) -
                        up[i] * (here[i] - above[i] - 0.5f * (sy[i] + sy_above[i]));
        residual.Row(y)[i] = r, direction.Row(y)[i] = r * inverse_.Row(y)[i];
        lanes[i % kLanes] += r * r * inverse_.Row(y)[i];
      }
    });
  }

  // The system's matrix times d; returns d . product.
  double Multiply(const Bordered& d, Bordered& product) const {
    return SumRows([&](int y, float* lanes) {
      const float *here = d.Row(y), *below = d.Row(y + 1), *above = d.Row(y - 1);
      const float *data = data_.Row(y), *right = right_.Row(y), *down = down_.Row(y), *up = down_.Row(y - 1);
      float* out = product.Row(y);
      for (int i = 0; i < area_.columns; i += kLanes)
        for (int k = i; k < i + kLanes; ++k) {
          out[k] = data[k] * here[k] + right[k] * (here[k] - here[k + 1]) +
                   right[k - 1] * (here[k] - here[k - 1]) + down[k] * (here[k] - below[k]) +
                   up[k] * (here[k] - above[k]);
          lanes[k - i] += here[k] * out[k];
        }
    });
  }

  // Returns the new residual's product with itself over the diagonal.
  double Step(float step, const Bordered& direction, const Bordered& product, Bordered& solution,
              Bordered& residual) const {
    return SumRows([&](int y, float* lanes) {
      const float *d = direction.Row(y), *p = product.Row(y), *inverse = inverse_.Row(y);
      float *s = solution.Row(y), *r = residual.Row(y);
      for (int i = 0; i < area_.columns; i += kLanes)
        for (int k = i; k < i + kLanes; ++k) {
          s[k] += step * d[k];
          r[k] -= step * p[k];
          lanes[k - i] += r[k] * r[k] * inverse[k];
        }
    });
  }

  void SetDirection(float keep, const Bordered& residual, Bordered& direction) const {
    ForRows([&](int y) {
      const float *r = residual.Row(y), *inverse = inverse_.Row(y);
      float* d = direction.Row(y);
      for (int i = 0; i < area_.columns; ++i) d[i] = r[i] * inverse[i] + keep * d[i];
    });
  }

  const Pinhole& camera_;
  const Image<float>& depth_;
  const Image<Eigen::Vector3f>& normals_;
  const IntegrationOptions& options_;
  const Rectangle area_;
  Bordered voted_, data_;       // log of the voted depth; its weight, 0 where there is none
  Bordered slope_x_, slope_y_;  // of log z per pixel, from the normal
  Bordered right_, down_;       // weights of the links to the next pixel
  Bordered inverse_;            // of the diagonal
};

}  // namespace

Image<float> IntegrateNormals(const Pinhole& camera, const Image<float>& depth,
                              const Image<float>& confidence, const Image<Eigen::Vector3f>& normals,
                              const Image<float>& start, const IntegrationOptions& options) {
  return Integrator(camera, depth, confidence, normals, options).Solve(start);
}

}  // namespace polarscan
