// SPDX-License-Identifier: Apache-2.0
#include "stereo/search/continuous.h"

#include <ceres/tiny_solver.h>

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "stereo/costs/pixel_cost.h"
#include "stereo/search/visibility.h"

namespace polarscan {
namespace {

constexpr float kLeastShare = 0.02f;  // sources that count less are left out

// Two unit vectors at right angles to `n` and to each other.
std::pair<Eigen::Vector3f, Eigen::Vector3f> Tangents(const Eigen::Vector3f& n) {
  const Eigen::Vector3f a = n.unitOrthogonal();
  return {a, n.cross(a)};
}

// The terms' square roots as a function of (change of log depth / kDepthScale, two slopes of the normal).
class PixelTerms {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 3 };

  PixelTerms(const PixelCost& cost, const PixelContext& pixel, const Hypothesis& start)
      : cost_(cost), pixel_(pixel), start_(start), tangents_(Tangents(start.normal)) {}

  int NumResiduals() const { return int(cost_.TermCount(pixel_)); }

  Hypothesis At(const double* x) const {
    const Eigen::Vector3f n = start_.normal + float(x[1]) * tangents_.first + float(x[2]) * tangents_.second;
    return {start_.depth * float(std::exp(kDepthScale * x[0])), n.normalized()};
  }

  bool operator()(const double* x, double* residuals, double* jacobian) const {
    Residuals(x, residuals);
    if (!jacobian) return true;
    const int count = NumResiduals();
    for (int k = 0; k < NUM_PARAMETERS; ++k) {
      double beside[NUM_PARAMETERS] = {x[0], x[1], x[2]};
      beside[k] += kStep;
      double* column = jacobian + k * count;  // column-major
      Residuals(beside, column);
      for (int i = 0; i < count; ++i) column[i] = (column[i] - residuals[i]) / kStep;
    }
    return true;
  }

 private:
  // One unit of each parameter moves the picture about as much as the others do: a share of the depth against
  // a slope across the window.
  static constexpr double kDepthScale = 0.05, kStep = 0.01;

  void Residuals(const double* x, double* residuals) const {
    std::array<float, kMaxTerms> terms;
    const std::size_t count = cost_.Terms(pixel_, At(x), terms.data());
    for (std::size_t i = 0; i < count; ++i) residuals[i] = std::sqrt(double(terms[i]));
  }

  const PixelCost& cost_;
  const PixelContext& pixel_;
  const Hypothesis start_;
  const std::pair<Eigen::Vector3f, Eigen::Vector3f> tangents_;
};

class Refiner {
 public:
  Refiner(const Problem& problem, const StereoOptions& options, const std::vector<float>& selection,
          const DepthNormalMap& before)
      : problem_(problem),
        options_(options),
        selection_(selection),
        before_(before),
        cost_(problem, options),
        prior_(options) {}

  Hypothesis Refined(int x, int y) const {
    const Hypothesis start{before_.depth(x, y), before_.normal(x, y)};
    PixelContext pixel;
    Prepare(x, y, start, pixel);
    if (pixel.chosen_count == 0) return start;
    const PixelTerms terms(cost_, pixel, start);
    ceres::TinySolver<PixelTerms> solver;
    solver.options.max_num_iterations = options_.continuous_iterations;
    solver.options.function_tolerance = 1e-6;
    Eigen::Vector3d change = Eigen::Vector3d::Zero();
    solver.Solve(terms, &change);
    const Hypothesis end = terms.At(change.data());
    const bool valid = end.depth >= problem_.depth_min && end.depth <= problem_.depth_max &&
                       end.normal.dot(pixel.ray) < -1e-3f && end.normal.allFinite();
    constexpr float kAll = 1e30f;
    return valid && cost_.Total(pixel, end, nullptr, kAll) < cost_.Total(pixel, start, nullptr, kAll) ? end
                                                                                                      : start;
  }

 private:
  Neighbour NeighbourAt(int x, int y) const {
    if (!before_.depth.Contains(x, y) || before_.depth(x, y) <= 0) return {{}, problem_.Ray(x, y)};
    return {{before_.depth(x, y), before_.normal(x, y)}, problem_.Ray(x, y)};
  }

  void Prepare(int x, int y, const Hypothesis& start, PixelContext& pixel) const {
    cost_.Place(x, y, pixel);
    pixel.neighbours = {NeighbourAt(x - 1, y), NeighbourAt(x + 1, y), NeighbourAt(x, y - 1),
                        NeighbourAt(x, y + 1)};
    if (pixel.neighbours[0].estimate.depth <= 0) pixel.neighbours[0] = pixel.neighbours[1];
    const std::size_t sources = cost_.sources();
    const float* seen =
        &selection_[(std::size_t(y) * std::size_t(before_.depth.width()) + std::size_t(x)) * sources];
    std::array<float, kMaxSources> weights;
    float sum = 0;
    for (std::size_t s = 0; s < sources; ++s)
      sum += weights[s] =
          seen[s] * prior_(problem_, problem_.sources[s], pixel.ray, pixel.turned_rays[s], start);
    for (std::size_t s = 0; s < sources; ++s) {
      const float share = sum > 0 ? weights[s] / sum : 1 / float(sources);
      if (share < kLeastShare) continue;
      pixel.chosen[pixel.chosen_count++] = {s, share, share * float(options_.samples)};
    }
  }

  const Problem& problem_;
  const StereoOptions& options_;
  const std::vector<float>& selection_;
  const DepthNormalMap& before_;
  const PixelCost cost_;
  const SourcePrior prior_;
};

}  // namespace

void RefineContinuously(const Problem& problem, const StereoOptions& options,
                        const std::vector<float>& selection, DepthNormalMap& map, const Progress& progress) {
  const DepthNormalMap before = map;
  const Refiner refiner(problem, options, selection, before);
  ParallelFor(0, before.depth.height(), [&](int y) {
    progress.Check();
    for (int x = 0; x < before.depth.width(); ++x) {
      if (!problem.Active(x, y) || before.depth(x, y) <= 0) continue;
      const Hypothesis refined = refiner.Refined(x, y);
      map.depth(x, y) = refined.depth;
      map.normal(x, y) = refined.normal;
    }
  });
}

}  // namespace polarscan
