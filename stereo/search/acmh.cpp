// SPDX-License-Identifier: Apache-2.0
#include "stereo/search/acmh.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "stereo/costs/hypotheses.h"
#include "stereo/costs/pixel_cost.h"
#include "stereo/search/visibility.h"
#include "stereo/search/zones.h"

namespace polarscan {
namespace {

constexpr float kPriorAngle = std::numbers::pi_v<float> * 5 / 180;
constexpr std::size_t kZones = 8,
                      kStartSources = 4;  // kStartSources: sources that a start's cost is the mean of
using Sources = std::bitset<kMaxSources>;

// By source: how often it was drawn for a pixel.
struct Drawn {
  std::array<int, kMaxSources> counts{};
  int total = 0;
};

class Acmh {
 public:
  Acmh(const Problem& problem, const StereoOptions& options, CostedMap& state)
      : problem_(problem),
        options_(options),
        state_(state),
        cost_(problem, options),
        geometric_(!problem.sources.empty() && problem.sources[0].map != nullptr),
        chosen_(state.cost.width(), state.cost.height()),
        zones_(MakeZones()) {}

  // Gives pixels without an estimate a random one; all get a cost.
  void Start(int y) {
    for (int x = 0; x < state_.cost.width(); ++x) {
      if (!problem_.Active(x, y)) continue;
      PixelContext pixel;
      cost_.Place(x, y, pixel);
      Random random = PixelRandom(problem_, options_.seed, x, y, -1);
      if (state_.map.depth(x, y) <= 0) {
        state_.map.depth(x, y) = random.Uniform(problem_.depth_min, problem_.depth_max);
        state_.map.normal(x, y) = RandomNormal(pixel.ray, random);
      }
      state_.cost(x, y) = StartCost(pixel, At(x, y));
    }
  }

  // The sources that match best at the start.
  void ChooseBest(int y) {
    for (int x = 0; x < state_.cost.width(); ++x) {
      if (!problem_.Active(x, y)) continue;
      PixelContext pixel;
      cost_.Place(x, y, pixel);
      const auto costs = MatchAll(pixel, At(x, y));
      for (std::size_t s : Order(costs)) {
        if (chosen_(x, y).count() == kStartSources) break;
        chosen_(x, y).set(s);
      }
    }
  }

  void Update(int y, int colour, int iteration, const AcmhPass& pass) {
    for (int x = (y + colour) & 1; x < state_.cost.width(); x += 2)
      if (problem_.Active(x, y)) UpdatePixel(x, y, iteration, pass);
  }

 private:
  using SourceCosts = std::array<float, kMaxSources>;

  Hypothesis At(int x, int y) const { return {state_.map.depth(x, y), state_.map.normal(x, y)}; }

  float Geometric(const PixelContext& pixel, const Hypothesis& hypothesis, std::size_t source) const {
    if (!geometric_) return 0;
    const Source& s = problem_.sources[source];
    return float(options_.geometric_weight) * GeometricError(problem_.reference->camera, s,
                                                             Look(s, hypothesis.depth * pixel.ray), pixel.ray,
                                                             float(options_.geometric_max_px));
  }

  SourceCosts MatchAll(const PixelContext& pixel, const Hypothesis& hypothesis) const {
    SourceCosts costs;
    for (std::size_t s = 0; s < cost_.sources(); ++s) costs[s] = cost_.Match(pixel, hypothesis, s);
    return costs;
  }

  std::vector<std::size_t> Order(const SourceCosts& costs) const {
    std::vector<std::size_t> order(cost_.sources());
    for (std::size_t s = 0; s < order.size(); ++s) order[s] = s;
    std::ranges::stable_sort(order, {}, [&](std::size_t s) { return costs[s]; });
    return order;
  }

  float StartCost(const PixelContext& pixel, const Hypothesis& hypothesis) const {
    const SourceCosts costs = MatchAll(pixel, hypothesis);
    const std::vector<std::size_t> order = Order(costs);
    const std::size_t count = std::min(kStartSources, order.size());
    float sum = 0;
    for (std::size_t k = 0; k < count; ++k) sum += costs[order[k]] + Geometric(pixel, hypothesis, order[k]);
    return sum / float(count);
  }

  // The plane of the zone's cheapest pixel at this pixel's ray; depth 0: none.
  Hypothesis FromZone(const PixelContext& pixel, const std::vector<Offset>& zone) const {
    float least = 1e30f;
    int bx = -1, by = -1;
    for (const auto& [dx, dy] : zone) {
      const int x = pixel.x + dx, y = pixel.y + dy;
      if (!state_.cost.Contains(x, y) || state_.map.depth(x, y) <= 0 || state_.cost(x, y) >= least) continue;
      least = state_.cost(x, y), bx = x, by = y;
    }
    if (bx < 0) return {};
    const Hypothesis there = At(bx, by);
    const float depth = DepthOnPlane(there, problem_.Ray(bx, by), pixel.ray);
    const bool valid =
        depth >= problem_.depth_min && depth <= problem_.depth_max && there.normal.dot(pixel.ray) < -1e-3f;
    return valid ? Hypothesis{depth, there.normal} : Hypothesis{};
  }

  // Multi-hypothesis joint view selection: a source that matches three of the eight hypotheses well and fewer
  // than three badly is likely to see the pixel, more so if pixels beside have chosen it.
  Drawn DrawSourcesFor(const PixelContext& pixel, const std::array<SourceCosts, kZones>& costs,
                       const std::array<Hypothesis, kZones>& candidates, int iteration,
                       Random& random) const {
    const float good_limit = 0.8f * std::exp(-float(iteration * iteration) / 90);
    std::array<float, kMaxSources> weights;
    for (std::size_t s = 0; s < cost_.sources(); ++s) {
      float weight = 0;
      int good = 0, bad = 0;
      for (std::size_t j = 0; j < kZones; ++j) {
        const float cost = candidates[j].depth > 0 ? costs[j][s] : 2;
        bad += cost > 1.2f;
        if (cost >= good_limit) continue;
        ++good;
        weight += std::exp(-cost * cost / 0.18f);
      }
      weights[s] = 0;
      if (good > 2 && bad < 3)
        weights[s] = weight / float(good);
      else if (bad < 3)
        weights[s] = std::exp(-good_limit * good_limit / 0.32f);
      weights[s] *= PriorOf(pixel, s);
    }
    Drawn drawn;
    DrawSources({weights.data(), cost_.sources()}, options_.samples, random,
                {drawn.counts.data(), cost_.sources()});
    for (std::size_t s = 0; s < cost_.sources(); ++s) drawn.total += drawn.counts[s];
    return drawn;
  }

  float PriorOf(const PixelContext& pixel, std::size_t source) const {
    float prior = 0;
    for (std::size_t zone = 0; zone < kZones; zone += 2) {
      const Offset beside = zones_[zone][0];
      const int x = pixel.x + beside.dx, y = pixel.y + beside.dy;
      if (chosen_.Contains(x, y)) prior += chosen_(x, y).test(source) ? 0.9f : 0.1f;
    }
    return prior;
  }

  // The drawn sources' mean cost. known: its matching costs by source, if they are known.
  float CostOf(const PixelContext& pixel, const Hypothesis& hypothesis, const Drawn& drawn,
               const SourceCosts* known) const {
    float sum = 0;
    for (std::size_t s = 0; s < cost_.sources(); ++s) {
      if (drawn.counts[s] == 0) continue;
      const float match = known ? (*known)[s] : cost_.Match(pixel, hypothesis, s);
      sum += float(drawn.counts[s]) * (match + Geometric(pixel, hypothesis, s));
    }
    return sum / float(drawn.total);
  }

  // What decides between hypotheses, the greater the better: with a planar prior exp(-cost^2 / beta) (gamma +
  // exp(-depth difference^2 / ...) exp(-angle^2 / ...)).
  float Score(int x, int y, const Hypothesis& hypothesis, float cost, const AcmhPass& pass) const {
    if (!pass.prior || pass.prior->depth(x, y) <= 0) return -cost;
    constexpr float kBeta = 0.18f, kGamma = 0.5f;
    const float sigma = (problem_.depth_max - problem_.depth_min) / 64;
    const float depth = hypothesis.depth - pass.prior->depth(x, y);
    const float angle = std::acos(std::clamp(hypothesis.normal.dot(pass.prior->normal(x, y)), -1.0f, 1.0f));
    const float near =
        std::exp(-depth * depth / (2 * sigma * sigma) - angle * angle / (2 * kPriorAngle * kPriorAngle));
    return std::exp(-cost * cost / kBeta) * (kGamma + near);
  }

  void UpdatePixel(int x, int y, int iteration, const AcmhPass& pass) {
    Random random = PixelRandom(problem_, options_.seed, x, y, pass.first_iteration + iteration);
    PixelContext pixel;
    cost_.Place(x, y, pixel);
    std::array<Hypothesis, kZones> candidates;
    std::array<SourceCosts, kZones> costs;
    for (std::size_t j = 0; j < kZones; ++j) {
      candidates[j] = FromZone(pixel, zones_[j]);
      if (candidates[j].depth > 0) costs[j] = MatchAll(pixel, candidates[j]);
    }
    const Drawn drawn = DrawSourcesFor(pixel, costs, candidates, iteration, random);
    Hypothesis best = At(x, y);
    float best_cost = CostOf(pixel, best, drawn, nullptr), best_score = Score(x, y, best, best_cost, pass);
    const auto consider = [&](const Hypothesis& hypothesis, const SourceCosts* known) {
      if (hypothesis.depth < problem_.depth_min || hypothesis.depth > problem_.depth_max ||
          hypothesis.normal.dot(pixel.ray) > -1e-3f)
        return;
      const float cost = CostOf(pixel, hypothesis, drawn, known);
      const float score = Score(x, y, hypothesis, cost, pass);
      if (score > best_score) best = hypothesis, best_cost = cost, best_score = score;
    };
    for (std::size_t j = 0; j < kZones; ++j)
      if (candidates[j].depth > 0) consider(candidates[j], &costs[j]);
    for (const Hypothesis& hypothesis : Refinements(pixel, best, pass, random)) consider(hypothesis, nullptr);
    state_.map.depth(x, y) = best.depth;
    state_.map.normal(x, y) = best.normal;
    state_.cost(x, y) = best_cost;
    for (std::size_t s = 0; s < cost_.sources(); ++s) chosen_(x, y).set(s, drawn.counts[s] > 0);
  }

  // Random ones, near the prior if there is one, and ones perturbed by 2 %.
  std::array<Hypothesis, 5> Refinements(const PixelContext& pixel, const Hypothesis& best,
                                        const AcmhPass& pass, Random& random) const {
    constexpr float kPerturbation = 0.02f;
    float depth = random.Uniform(problem_.depth_min, problem_.depth_max);
    Eigen::Vector3f normal = RandomNormal(pixel.ray, random);
    if (pass.prior && pass.prior->depth(pixel.x, pixel.y) > 0) {
      const float third = 3 * (problem_.depth_max - problem_.depth_min) / 64;
      depth = pass.prior->depth(pixel.x, pixel.y) + random.Uniform(-third, third);
      normal = PerturbedNormal(pass.prior->normal(pixel.x, pixel.y), pixel.ray, kPriorAngle, random);
    }
    const float near_by = best.depth * random.Uniform(1 - kPerturbation, 1 + kPerturbation);
    const Eigen::Vector3f turned =
        PerturbedNormal(best.normal, pixel.ray, kPerturbation * std::numbers::pi_v<float>, random);
    return {{{depth, best.normal},
             {best.depth, normal},
             {depth, normal},
             {best.depth, turned},
             {near_by, best.normal}}};
  }

  const Problem& problem_;
  const StereoOptions& options_;
  CostedMap& state_;
  const PixelCost cost_;
  const bool geometric_;
  Image<Sources> chosen_;
  const std::vector<std::vector<Offset>> zones_;
};

}  // namespace

CostedMap StartAcmh(const Problem& problem, const StereoOptions& options, DepthNormalMap map,
                    const Progress& progress) {
  const int width = problem.reference->gray.width(), height = problem.reference->gray.height();
  if (map.depth.empty())
    map = {Image<float>(width, height), Image<Eigen::Vector3f>(width, height, Eigen::Vector3f::Zero())};
  CostedMap state{std::move(map), Image<float>(width, height)};
  Acmh acmh(problem, options, state);
  ParallelFor(0, height, [&](int y) {
    progress.Check();
    acmh.Start(y);
  });
  return state;
}

void RunAcmh(const Problem& problem, const StereoOptions& options, const AcmhPass& pass, CostedMap& state,
             const Progress& progress) {
  const int height = state.cost.height();
  Acmh acmh(problem, options, state);
  ParallelFor(0, height, [&](int y) { acmh.ChooseBest(y); });
  for (int iteration = 0; iteration < pass.iterations; ++iteration)
    for (int colour = 0; colour < 2; ++colour)
      ParallelFor(0, height, [&](int y) {
        progress.Check();
        acmh.Update(y, colour, iteration, pass);
      });
}

}  // namespace polarscan
