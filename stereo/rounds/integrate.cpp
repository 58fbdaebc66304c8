// SPDX-License-Identifier: Apache-2.0
#include "stereo/rounds/integrate.h"

#include <cmath>
#include <vector>

#include "core/parallel.h"

namespace polarscan {
namespace {

// A link to the right (dx = 1) or down (dy = 1): weight g and the slope that the normals ask for.
struct Link {
  float weight = 0, slope = 0;
};

class Integrator {
 public:
  Integrator(const Pinhole& camera, const Image<float>& depth, const Image<float>& confidence,
             const Image<Eigen::Vector3f>& normals, const IntegrationOptions& options)
      : camera_(camera),
        normals_(normals),
        options_(options),
        width_(depth.width()),
        height_(depth.height()),
        log_depth_(width_, height_),
        data_(width_, height_),
        right_(width_, height_),
        down_(width_, height_) {
    ParallelFor(0, height_, [&](int y) {
      for (int x = 0; x < width_; ++x) {
        if (depth(x, y) <= 0) continue;
        log_depth_(x, y) = std::log(depth(x, y));
        data_(x, y) = 1e-6f + options.data_weight * std::min(confidence(x, y), options.max_confidence);
      }
    });
    ParallelFor(0, height_, [&](int y) {
      for (int x = 0; x < width_; ++x) {
        if (data_(x, y) <= 0) continue;
        if (x + 1 < width_ && data_(x + 1, y) > 0) right_(x, y) = MakeLink(x, y, 1, 0);
        if (y + 1 < height_ && data_(x, y + 1) > 0) down_(x, y) = MakeLink(x, y, 0, 1);
      }
    });
  }

  Image<float> Solve() {
    // Unknown: the change of log z, so the first residual is that of the start.
    Image<float> change(width_, height_), residual(width_, height_), direction(width_, height_),
        product(width_, height_), diagonal(width_, height_);
    ParallelFor(0, height_, [&](int y) {
      for (int x = 0; x < width_; ++x) {
        if (data_(x, y) <= 0) continue;
        float sum = 0, weight = data_(x, y);
        const auto pull = [&](const Link& link, int ox, int oy, float sign) {
          sum += link.weight * (log_depth_(ox, oy) - log_depth_(x, y) - sign * link.slope);
          weight += link.weight;
        };
        ForLinks(x, y, pull);
        residual(x, y) = sum, diagonal(x, y) = weight;
        direction(x, y) = sum / weight;
      }
    });
    double error = RowSum([&](int x, int y) { return residual(x, y) * direction(x, y); });
    const double enough = error * options_.tolerance * options_.tolerance;
    for (int i = 0; i < options_.iterations && error > enough; ++i) {
      ParallelFor(0, height_, [&](int y) {
        for (int x = 0; x < width_; ++x) {
          if (data_(x, y) <= 0) continue;
          float sum = data_(x, y) * direction(x, y);
          ForLinks(x, y, [&](const Link& link, int ox, int oy, float) {
            sum += link.weight * (direction(x, y) - direction(ox, oy));
          });
          product(x, y) = sum;
        }
      });
      const double curvature = RowSum([&](int x, int y) { return direction(x, y) * product(x, y); });
      if (!(curvature > 0)) break;
      const float step = float(error / curvature);
      const double next = RowSum([&](int x, int y) {
        change(x, y) += step * direction(x, y);
        residual(x, y) -= step * product(x, y);
        return residual(x, y) * residual(x, y) / diagonal(x, y);
      });
      const float keep = float(next / error);
      error = next;
      ParallelFor(0, height_, [&](int y) {
        for (int x = 0; x < width_; ++x)
          if (data_(x, y) > 0) direction(x, y) = residual(x, y) / diagonal(x, y) + keep * direction(x, y);
      });
    }
    Image<float> depth(width_, height_);
    ParallelFor(0, height_, [&](int y) {
      for (int x = 0; x < width_; ++x)
        if (data_(x, y) > 0) depth(x, y) = std::exp(log_depth_(x, y) + change(x, y));
    });
    return depth;
  }

 private:
  // d log z / d(pixel) along x (axis 0) or y (axis 1).
  float Slope(int x, int y, int axis) const {
    const Eigen::Vector3f ray = camera_.Ray(x + 0.5, y + 0.5).cast<float>();
    const Eigen::Vector3f& n = normals_(x, y);
    const float facing = std::min(n.dot(ray), -0.05f);
    return -n[axis] / (float(axis ? camera_.fy : camera_.fx) * facing);
  }

  Link MakeLink(int x, int y, int dx, int dy) const {
    const float slope = 0.5f * (Slope(x, y, dy) + Slope(x + dx, y + dy, dy));
    const float misfit = (log_depth_(x + dx, y + dy) - log_depth_(x, y) - slope) * float(camera_.fx) / 2;
    const float jump = (normals_(x + dx, y + dy) - normals_(x, y)).norm() / options_.normal_jump;
    const float gate = 1 / ((1 + misfit * misfit) * (1 + misfit * misfit) * (1 + jump * jump));
    return {std::max(gate, 1e-4f), slope};
  }

  // f(link, other x, other y, +1 if the link leads there and -1 if it comes from there)
  template <class F>
  void ForLinks(int x, int y, F&& f) const {
    if (right_(x, y).weight > 0) f(right_(x, y), x + 1, y, 1.0f);
    if (x > 0 && right_(x - 1, y).weight > 0) f(right_(x - 1, y), x - 1, y, -1.0f);
    if (down_(x, y).weight > 0) f(down_(x, y), x, y + 1, 1.0f);
    if (y > 0 && down_(x, y - 1).weight > 0) f(down_(x, y - 1), x, y - 1, -1.0f);
  }

  // Sum over all pixels in an order that does not depend on the threads.
  template <class F>
  double RowSum(F&& f) const {
    std::vector<double> rows(std::size_t(height_), 0.0);
    ParallelFor(0, height_, [&](int y) {
      double sum = 0;
      for (int x = 0; x < width_; ++x)
        if (data_(x, y) > 0) sum += double(f(x, y));
      rows[std::size_t(y)] = sum;
    });
    double sum = 0;
    for (double row : rows) sum += row;
    return sum;
  }

  const Pinhole& camera_;
  const Image<Eigen::Vector3f>& normals_;
  const IntegrationOptions& options_;
  const int width_, height_;
  Image<float> log_depth_, data_;
  Image<Link> right_, down_;
};

}  // namespace

Image<float> IntegrateNormals(const Pinhole& camera, const Image<float>& depth,
                              const Image<float>& confidence, const Image<Eigen::Vector3f>& normals,
                              const IntegrationOptions& options) {
  return Integrator(camera, depth, confidence, normals, options).Solve();
}

}  // namespace polarscan
