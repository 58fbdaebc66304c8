// SPDX-License-Identifier: Apache-2.0
#include "stereo/search/sweep.h"

#include <algorithm>
#include <numbers>

#include "core/parallel.h"
#include "core/random.h"
#include "stereo/costs/hypotheses.h"
#include "stereo/costs/pixel_cost.h"
#include "stereo/search/visibility.h"

namespace polarscan {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
float RandomDepth(const DepthInterval& interval, Random& random) {
  return random.Uniform(interval.near_depth, interval.far_depth);
}

class LineSweeper {
 public:
  LineSweeper(const Problem& problem, const StereoOptions& options, const Image<DepthInterval>& hull,
              const Sweep& sweep, MatchState& state)
      : problem_(problem),
        options_(options),
        hull_(hull),
        sweep_(sweep),
        state_(state),
        before_(state.map),
        cost_(problem, options),
        visibility_(options.ncc_sigma),
        prior_(options),
        sources_(problem.sources.size()) {}

  // All pixels (x, y) of one line, from its start along the sweep's direction.
  void Run(int line) const {
    std::vector<std::pair<int, int>> pixels;
    const int width = problem_.reference->gray.width(), height = problem_.reference->gray.height();
    for (int i = 0; i < (sweep_.dx ? width : height); ++i) {
      const int along = sweep_.dx + sweep_.dy > 0 ? i : (sweep_.dx ? width : height) - 1 - i;
      const int x = sweep_.dx ? along : line, y = sweep_.dx ? line : along;
      if (problem_.Active(x, y)) pixels.emplace_back(x, y);
    }
    if (pixels.empty()) return;
    const std::vector<float> backward = BackwardMessages(pixels);
    std::vector<float> forward(sources_, 0.5f);
    for (std::size_t i = 0; i < pixels.size(); ++i)
      Update(pixels[i].first, pixels[i].second, &backward[i * sources_], forward);
  }

  std::size_t StateIndex(int x, int y) const {
    return (std::size_t(y) * std::size_t(problem_.reference->gray.width()) + std::size_t(x)) * sources_;
  }

  void Place(int x, int y, PixelContext& pixel) const { cost_.Place(x, y, pixel); }

  void RefreshCosts(const PixelContext& pixel, const Hypothesis& hypothesis, float* costs) const {
    for (std::size_t s = 0; s < sources_; ++s) costs[s] = cost_.Match(pixel, hypothesis, s);
  }

 private:
  std::vector<float> BackwardMessages(const std::vector<std::pair<int, int>>& pixels) const {
    std::vector<float> messages(pixels.size() * sources_);
    std::vector<float> message(sources_, 0.5f);
    for (std::size_t i = pixels.size(); i-- > 0;) {
      const float* costs = &state_.costs[StateIndex(pixels[i].first, pixels[i].second)];
      for (std::size_t s = 0; s < sources_; ++s)
        messages[i * sources_ + s] = message[s] = visibility_.Backward(costs[s], message[s]);
    }
    return messages;
  }

  Hypothesis At(const DepthNormalMap& map, int x, int y) const { return {map.depth(x, y), map.normal(x, y)}; }

  Neighbour NeighbourAt(const DepthNormalMap& map, int x, int y) const {
    if (!map.depth.Contains(x, y) || map.depth(x, y) <= 0) return {{}, problem_.Ray(x, y)};
    return {At(map, x, y), problem_.Ray(x, y)};
  }

  void Prepare(int x, int y, const float* backward, const std::vector<float>& forward, Random& random,
               PixelContext& pixel) const {
    cost_.Place(x, y, pixel);
    const int dx = sweep_.dx, dy = sweep_.dy;
    pixel.neighbours = {NeighbourAt(state_.map, x - dx, y - dy), NeighbourAt(state_.map, x + dx, y + dy),
                        NeighbourAt(before_, x - dy, y - dx), NeighbourAt(before_, x + dy, y + dx)};
    const Hypothesis current = At(state_.map, x, y);
    const std::size_t at = StateIndex(x, y);
    std::array<float, kMaxSources> weights;
    for (std::size_t s = 0; s < sources_; ++s) {
      const float seen =
          Visibility::Posterior(visibility_.Forward(state_.costs[at + s], forward[s]), backward[s]);
      const float kept =
          sweep_.selection_memory * state_.selection[at + s] + (1 - sweep_.selection_memory) * seen;
      weights[s] = kept * prior_(problem_, problem_.sources[s], pixel.ray, pixel.turned_rays[s], current);
    }
    std::array<int, kMaxSources> counts;
    DrawSources({weights.data(), sources_}, options_.samples, random, {counts.data(), sources_});
    int total = 0;
    for (std::size_t s = 0; s < sources_; ++s) total += counts[s];
    for (std::size_t s = 0; s < sources_; ++s)
      if (counts[s])
        pixel.chosen[pixel.chosen_count++] = {s, float(counts[s]) / float(total), float(counts[s])};
    std::stable_sort(
        pixel.chosen.begin(), pixel.chosen.begin() + std::ptrdiff_t(pixel.chosen_count),
        [](const PixelContext::Chosen& l, const PixelContext::Chosen& r) { return l.count > r.count; });
  }

  void Update(int x, int y, const float* backward, std::vector<float>& forward) const {
    Random random = PixelRandom(problem_, options_.seed, x, y, sweep_.index);
    PixelContext pixel;
    Prepare(x, y, backward, forward, random, pixel);
    const std::size_t at = StateIndex(x, y);
    const Hypothesis current = At(state_.map, x, y);
    Hypothesis best = current;
    float best_cost = cost_.Total(pixel, current, &state_.costs[at], 1e30f);
    const auto consider = [&](const Hypothesis& hypothesis) {
      if (hypothesis.depth <= 0 || hypothesis.normal.dot(pixel.ray) > -1e-3f) return;
      const float cost = cost_.Total(pixel, hypothesis, nullptr, best_cost);
      if (cost < best_cost) best_cost = cost, best = hypothesis;
    };
    TryHypotheses(pixel, current, random, consider);
    if (best.depth != current.depth || best.normal != current.normal) {
      state_.map.depth(x, y) = best.depth;
      state_.map.normal(x, y) = best.normal;
      RefreshCosts(pixel, best, &state_.costs[at]);
    }
    for (std::size_t s = 0; s < sources_; ++s) {
      forward[s] = visibility_.Forward(state_.costs[at + s], forward[s]);
      const float seen = Visibility::Posterior(forward[s], backward[s]);
      state_.selection[at + s] =
          sweep_.selection_memory * state_.selection[at + s] + (1 - sweep_.selection_memory) * seen;
    }
  }

  // The set A of eq. (1), without the current estimate, and the closed-form additions.
  template <class Consider>
  void TryHypotheses(const PixelContext& pixel, const Hypothesis& current, Random& random,
                     Consider&& consider) const {
    const Neighbour& behind = pixel.neighbours[0];
    if (behind.estimate.depth > 0)
      consider({DepthOnPlane(behind.estimate, behind.ray, pixel.ray), behind.estimate.normal});
    const float near_by = sweep_.random_depth;
    const float depth = near_by > 0 ? current.depth * random.Uniform(1 - near_by, 1 + near_by)
                                    : RandomDepth(hull_(pixel.x, pixel.y), random);
    const Hypothesis drawn{depth, RandomNormal(pixel.ray, random)};
    const float change = sweep_.perturbation * float(options_.depth_perturbation);
    const Hypothesis perturbed{
        current.depth * random.Uniform(1 - change, 1 + change),
        PerturbedNormal(current.normal, pixel.ray, sweep_.perturbation * kPi / 2, random)};
    if (options_.random_hypotheses) {
      consider({drawn.depth, current.normal});
      consider({current.depth, drawn.normal});
      consider(drawn);
    } else {
      consider(perturbed);
    }
    consider({perturbed.depth, current.normal});
    consider({current.depth, perturbed.normal});
    if (!options_.closed_form_normals || !cost_.polarized()) return;
    const float also = current.depth * random.Uniform(1 - change, 1 + change);
    const auto labels = AopLabels(random.Below(3));
    consider({current.depth,
              cost_.ClosedFormNormal(pixel, {current.depth, current.normal}, AopLabels::kFromNormal)});
    consider({also, cost_.ClosedFormNormal(pixel, {also, current.normal}, labels)});
  }

  const Problem& problem_;
  const StereoOptions& options_;
  const Image<DepthInterval>& hull_;
  const Sweep& sweep_;
  MatchState& state_;
  const DepthNormalMap before_;
  const PixelCost cost_;
  const Visibility visibility_;
  const SourcePrior prior_;
  const std::size_t sources_;
};

}  // namespace

MatchState InitialState(const Problem& problem, const StereoOptions& options,
                        const Image<DepthInterval>& hull, const DepthNormalMap* start) {
  const int width = problem.reference->gray.width(), height = problem.reference->gray.height();
  const std::size_t values = std::size_t(width) * std::size_t(height) * problem.sources.size();
  MatchState state{
      {Image<float>(width, height), Image<Eigen::Vector3f>(width, height, Eigen::Vector3f::Zero())},
      std::vector<float>(values),
      std::vector<float>(values, 0.5f)};
  ParallelFor(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      if (!problem.Active(x, y)) continue;
      Random random = PixelRandom(problem, options.seed, x, y, -1);
      const Eigen::Vector3f ray = problem.Ray(x, y);
      const bool known = start && start->depth(x, y) > 0;
      state.map.depth(x, y) = known ? start->depth(x, y) : RandomDepth(hull(x, y), random);
      state.map.normal(x, y) = known ? start->normal(x, y) : RandomNormal(ray, random);
    }
  });
  const Sweep none;
  const LineSweeper matcher(problem, options, hull, none, state);
  ParallelFor(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      if (!problem.Active(x, y)) continue;
      PixelContext pixel;
      matcher.Place(x, y, pixel);
      matcher.RefreshCosts(pixel, {state.map.depth(x, y), state.map.normal(x, y)},
                           &state.costs[matcher.StateIndex(x, y)]);
    }
  });
  return state;
}

void RunSweep(const Problem& problem, const StereoOptions& options, const Image<DepthInterval>& hull,
              const Sweep& sweep, MatchState& state, const Progress& progress) {
  const LineSweeper sweeper(problem, options, hull, sweep, state);
  const int lines = sweep.dx ? problem.reference->gray.height() : problem.reference->gray.width();
  ParallelFor(0, lines, [&](int line) {
    progress.Check();
    sweeper.Run(line);
  });
}

}  // namespace polarscan
