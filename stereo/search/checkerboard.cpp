// SPDX-License-Identifier: Apache-2.0
#include "stereo/search/checkerboard.h"

#include <algorithm>
#include <numbers>

#include "core/parallel.h"
#include "stereo/costs/pixel_cost.h"
#include "stereo/search/zones.h"

namespace polarscan {
namespace {

constexpr float kHalfTurn = std::numbers::pi_v<float> / 2;
constexpr int kCandidates = 9;  // the current estimate and one from each zone
using Costs = std::array<std::array<float, kMaxSources>, kCandidates>;

class Checkerboard {
 public:
  Checkerboard(const Problem& problem, const StereoOptions& options, const Image<DepthInterval>& hull,
               const CheckerboardPass& pass, DepthNormalMap& map)
      : problem_(problem),
        options_(options),
        hull_(hull),
        pass_(pass),
        map_(map),
        costs_(problem.reference->gray.width(), problem.reference->gray.height()),
        zones_(MakeZones()),
        cost_(problem, options),
        chosen_(std::min(std::size_t(options.chosen_sources), cost_.sources())) {}

  // An estimate for every active pixel, and what it costs.
  void Start(int y) {
    for (int x = 0; x < costs_.width(); ++x) {
      if (!problem_.Active(x, y)) continue;
      Random random = PixelRandom(problem_, options_.seed, x, y, -1);
      PixelContext pixel;
      cost_.Place(x, y, pixel);
      if (map_.depth(x, y) <= 0) {
        const DepthInterval& interval = hull_(x, y);
        const double u = random.Uniform();  // squared: surfaces lie at the near side of the hull
        map_.depth(x, y) = interval.near_depth + float(u * u) * (interval.far_depth - interval.near_depth);
        map_.normal(x, y) = RandomNormal(pixel.ray, random);
      }
      std::array<float, kMaxSources> costs;
      for (std::size_t s = 0; s < cost_.sources(); ++s) costs[s] = cost_.Match(pixel, At(x, y), s);
      std::partial_sort(costs.begin(), costs.begin() + chosen_, costs.begin() + cost_.sources());
      for (std::size_t s = 0; s < chosen_; ++s) costs_(x, y) += costs[s] / float(chosen_);
    }
  }

  void Update(int y, int colour, int iteration) {
    for (int x = (y + colour) & 1; x < costs_.width(); x += 2)
      if (problem_.Active(x, y)) UpdatePixel(x, y, iteration);
  }

 private:
  Hypothesis At(int x, int y) const { return {map_.depth(x, y), map_.normal(x, y)}; }

  bool HasEstimate(int x, int y) const { return map_.depth.Contains(x, y) && map_.depth(x, y) > 0; }

  // The plane of the zone's cheapest pixel at this pixel's ray; depth 0: none.
  Hypothesis FromZone(const PixelContext& pixel, const std::vector<Offset>& zone) const {
    float least = 1e30f;
    int bx = -1, by = -1;
    for (const auto& [dx, dy] : zone) {
      const int x = pixel.x + dx, y = pixel.y + dy;
      if (!HasEstimate(x, y) || costs_(x, y) >= least) continue;
      least = costs_(x, y), bx = x, by = y;
    }
    if (bx < 0) return {};
    const float depth = DepthOnPlane(At(bx, by), problem_.Ray(bx, by), pixel.ray);
    return {depth, map_.normal(bx, by)};
  }

  // The K sources that fit the candidates best. A source's weight is the mean over the candidates that it
  // fits of exp(-cost^2 / (2 beta^2)); one that fits hardly any candidate does not see the point.
  void ChoosePixelSources(const Costs& costs, const std::array<Hypothesis, kCandidates>& candidates,
                          int iteration, PixelContext& pixel) const {
    constexpr float kBeta = 0.3f, kGood = 0.8f, kBad = 1.2f;
    const float good_limit = kGood * std::exp(-float(iteration * iteration) / 90);
    std::array<PixelContext::Chosen, kMaxSources> all;
    for (std::size_t s = 0; s < cost_.sources(); ++s) {
      float weight = 0, least = 2;
      int good = 0, bad = 0;
      for (int j = 0; j < kCandidates; ++j) {
        if (candidates[std::size_t(j)].depth <= 0) continue;
        const float cost = costs[std::size_t(j)][s];
        least = std::min(least, cost);
        bad += cost > kBad;
        if (cost >= good_limit) continue;
        ++good;
        weight += std::exp(-cost * cost / (2 * kBeta * kBeta));
      }
      weight = good > 0 ? weight / float(good) : 0;
      if (good < 3 || bad > 2) weight *= 0.1f;
      all[s] = {s, weight + 1e-4f * (2 - least), 1};
    }
    std::partial_sort(all.begin(), all.begin() + chosen_, all.begin() + cost_.sources(),
                      [](const PixelContext::Chosen& l, const PixelContext::Chosen& r) {
                        return l.share != r.share ? l.share > r.share : l.source < r.source;
                      });
    float total = 0;
    for (std::size_t k = 0; k < chosen_; ++k) total += all[k].share;
    pixel.chosen_count = 0;
    for (std::size_t k = 0; k < chosen_; ++k)
      pixel.chosen[pixel.chosen_count++] = {all[k].source, all[k].share / total, 1};
  }

  void UpdatePixel(int x, int y, int iteration) {
    Random random = PixelRandom(problem_, options_.seed, x, y, pass_.first_iteration + iteration);
    PixelContext pixel;
    cost_.Place(x, y, pixel);
    constexpr Offset kBeside[4] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
    for (std::size_t k = 0; k < 4; ++k) {
      const int nx = x + kBeside[k].dx, ny = y + kBeside[k].dy;
      pixel.neighbours[k] = {HasEstimate(nx, ny) ? At(nx, ny) : Hypothesis{}, problem_.Ray(nx, ny)};
    }
    std::array<Hypothesis, kCandidates> candidates;
    candidates[0] = At(x, y);
    Costs costs;
    for (std::size_t j = 0; j < kCandidates; ++j) {
      if (j > 0) {
        candidates[j] = FromZone(pixel, zones_[j - 1]);
        if (candidates[j].normal.dot(pixel.ray) > -1e-3f) candidates[j].depth = 0;
      }
      if (candidates[j].depth <= 0) continue;
      for (std::size_t s = 0; s < cost_.sources(); ++s) costs[j][s] = cost_.Match(pixel, candidates[j], s);
    }
    ChoosePixelSources(costs, candidates, iteration, pixel);
    Hypothesis best = candidates[0];
    float best_cost = cost_.Total(pixel, best, costs[0].data(), 1e30f);
    const auto consider = [&](const Hypothesis& hypothesis, const float* known) {
      if (hypothesis.depth <= 0 || hypothesis.normal.dot(pixel.ray) > -1e-3f) return;
      const float cost = cost_.Total(pixel, hypothesis, known, best_cost);
      if (cost < best_cost) best_cost = cost, best = hypothesis;
    };
    for (std::size_t j = 1; j < kCandidates; ++j) consider(candidates[j], costs[j].data());
    Refine(pixel, best, iteration, random, [&](const Hypothesis& h) { consider(h, nullptr); });
    map_.depth(x, y) = best.depth;
    map_.normal(x, y) = best.normal;
    costs_(x, y) = best_cost;
  }

  // Random, perturbed and closed-form hypotheses around the best candidate.
  template <class Consider>
  void Refine(const PixelContext& pixel, const Hypothesis best, int iteration, Random& random,
              Consider&& consider) const {
    const float change = std::exp2(-float(iteration)) * (pass_.warm ? 0.25f : 1);
    const DepthInterval& hull = hull_(pixel.x, pixel.y);
    const float drawn_depth = pass_.warm ? best.depth * random.Uniform(0.99f, 1.01f)
                                         : random.Uniform(hull.near_depth, hull.far_depth);
    const Eigen::Vector3f drawn_normal = RandomNormal(pixel.ray, random);
    const float near_by = change * float(options_.depth_perturbation);
    const float depth = best.depth * random.Uniform(1 - near_by, 1 + near_by);
    const Eigen::Vector3f normal = PerturbedNormal(best.normal, pixel.ray, change * kHalfTurn, random);
    consider({drawn_depth, best.normal});
    consider({best.depth, drawn_normal});
    consider({drawn_depth, drawn_normal});
    consider({depth, best.normal});
    consider({best.depth, normal});
    consider({depth, normal});
    if (!options_.closed_form_normals || !cost_.polarized()) return;
    const auto labels = AopLabels(random.Below(3));
    consider({best.depth, cost_.ClosedFormNormal(pixel, best, AopLabels::kFromNormal)});
    consider({drawn_depth, cost_.ClosedFormNormal(pixel, {drawn_depth, best.normal}, labels)});
    consider({depth, cost_.ClosedFormNormal(pixel, {depth, best.normal}, labels)});
  }

  const Problem& problem_;
  const StereoOptions& options_;
  const Image<DepthInterval>& hull_;
  const CheckerboardPass& pass_;
  DepthNormalMap& map_;
  Image<float> costs_;
  const std::vector<std::vector<Offset>> zones_;
  const PixelCost cost_;
  const std::size_t chosen_;
};

}  // namespace

void RunCheckerboard(const Problem& problem, const StereoOptions& options, const Image<DepthInterval>& hull,
                     const CheckerboardPass& pass, DepthNormalMap& map, const Progress& progress) {
  const int width = problem.reference->gray.width(), height = problem.reference->gray.height();
  if (map.depth.empty())
    map = {Image<float>(width, height), Image<Eigen::Vector3f>(width, height, Eigen::Vector3f::Zero())};
  Checkerboard board(problem, options, hull, pass, map);
  ParallelFor(0, height, [&](int y) { board.Start(y); });
  for (int iteration = 0; iteration < pass.iterations; ++iteration)
    for (int colour = 0; colour < 2; ++colour)
      ParallelFor(0, height, [&](int y) {
        progress.Check();
        board.Update(y, colour, iteration);
      });
}

}  // namespace polarscan
