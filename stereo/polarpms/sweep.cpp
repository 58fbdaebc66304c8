// SPDX-License-Identifier: Apache-2.0
#include "stereo/polarpms/sweep.h"

#include <algorithm>
#include <numbers>

#include "core/parallel.h"
#include "core/random.h"
#include "stereo/polarpms/cost.h"
#include "stereo/polarpms/hypotheses.h"
#include "stereo/polarpms/selection.h"

namespace polarscan {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr int kMaxSources = 32;
// A point in each source; filled where it is asked for.
using SeenBy = std::array<Seen, kMaxSources>;

Random PixelRandom(const Problem& problem, const StereoOptions& options, int x, int y, int sweep) {
  const auto pixel = std::uint64_t(y) * std::uint64_t(problem.reference->gray.width()) + std::uint64_t(x);
  return Random(std::uint64_t(options.seed), std::uint64_t(problem.view_index), pixel, std::uint64_t(sweep));
}

float RandomDepth(const DepthInterval& interval, Random& random) {
  return random.Uniform(interval.near_depth, interval.far_depth);
}

// What the pixel being updated knows before any hypothesis is judged.
struct Pixel {
  int x = 0, y = 0;
  Eigen::Vector3f ray;
  std::array<Eigen::Vector3f, kMaxSources> turned_rays;  // the ray in each source's frame
  Patch patch;
  std::array<Neighbour, 4> neighbours;  // behind and ahead on the line, and on the two lines beside it
  // The sources that were drawn, the most often drawn first, and their shares of all draws.
  struct Drawn {
    std::size_t source;
    float share;
    float count;
  };
  std::array<Drawn, kMaxSources> drawn;
  std::size_t drawn_count = 0;
  std::span<const Drawn> Sources() const { return {drawn.data(), drawn_count}; }
};

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
        window_(MakeWindow(options.window_radius, options.window_step)),
        reader_(window_, options.sigma_color),
        visibility_(options.ncc_sigma),
        prior_(options),
        residual_(options),
        sources_(problem.sources.size()),
        geometric_(!problem.sources.empty() && problem.sources[0].map != nullptr),
        polarized_(!problem.reference->polar.empty()),
        silhouettes_(options.silhouettes),
        normalised_polarization_(options.polarization_evidence == "dop") {}

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

  void RefreshCosts(const Pixel& pixel, const Hypothesis& hypothesis, float* costs) const {
    for (std::size_t s = 0; s < sources_; ++s) costs[s] = Match(pixel, hypothesis, s);
  }

  void Place(int x, int y, Pixel& pixel) const {
    pixel.x = x, pixel.y = y, pixel.ray = problem_.Ray(x, y);
    for (std::size_t s = 0; s < sources_; ++s)
      pixel.turned_rays[s] = problem_.sources[s].rotation * pixel.ray;
    reader_.Read(problem_.reference->gray, problem_.reference->mask, x, y, pixel.patch);
  }

 private:
  Seen Look(const Pixel& pixel, std::size_t source, float depth) const {
    const Source& s = problem_.sources[source];
    return LookAt(s, depth * pixel.turned_rays[source] + s.translation);
  }

  float Match(const Pixel& pixel, const Hypothesis& hypothesis, std::size_t source) const {
    const Source& s = problem_.sources[source];
    const Warp warp =
        PlaneWarp(problem_.reference->camera, s, pixel.ray, pixel.turned_rays[source], hypothesis);
    return MatchingCostSimd(window_, pixel.patch, warp, s.view->packed, float(options_.ncc_epsilon));
  }

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
               Pixel& pixel) const {
    Place(x, y, pixel);
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
        pixel.drawn[pixel.drawn_count++] = {s, float(counts[s]) / float(total), float(counts[s])};
    std::stable_sort(pixel.drawn.begin(), pixel.drawn.begin() + std::ptrdiff_t(pixel.drawn_count),
                     [](const Pixel::Drawn& l, const Pixel::Drawn& r) { return l.count > r.count; });
  }

  void Update(int x, int y, const float* backward, std::vector<float>& forward) const {
    Random random = PixelRandom(problem_, options_, x, y, sweep_.index);
    Pixel pixel;
    Prepare(x, y, backward, forward, random, pixel);
    const std::size_t at = StateIndex(x, y);
    const Hypothesis current = At(state_.map, x, y);
    Hypothesis best = current;
    float best_cost = Cost(pixel, current, &state_.costs[at], 1e30f);
    const auto consider = [&](const Hypothesis& hypothesis) {
      if (hypothesis.depth <= 0 || hypothesis.normal.dot(pixel.ray) > -1e-3f) return;
      const float cost = Cost(pixel, hypothesis, nullptr, best_cost);
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
  void TryHypotheses(const Pixel& pixel, const Hypothesis& current, Random& random,
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
    consider({drawn.depth, current.normal});
    consider({current.depth, drawn.normal});
    consider(drawn);
    consider({perturbed.depth, current.normal});
    consider({current.depth, perturbed.normal});
    if (!options_.closed_form_normals || !polarized_) return;
    const float also = current.depth * random.Uniform(1 - change, 1 + change);
    const auto labels = AopLabels(random.Below(3));
    consider(
        {current.depth, ClosedFormNormal(pixel, {current.depth, current.normal}, AopLabels::kFromNormal)});
    consider({also, ClosedFormNormal(pixel, {also, current.normal}, labels)});
  }

  Eigen::Vector3f ClosedFormNormal(const Pixel& pixel, const Hypothesis& start, AopLabels labels) const {
    std::array<AopConstraint, kMaxSources + 1> constraints;
    std::size_t count = 0;
    const PolarSample& own = problem_.reference->polar(pixel.x, pixel.y);
    if (own.weight > 0) constraints[count++] = MakeAopConstraint(own, pixel.ray.x(), pixel.ray.y());
    for (const Pixel::Drawn& drawn : pixel.Sources()) {
      const Source& source = problem_.sources[drawn.source];
      const Seen seen = Look(pixel, drawn.source, start.depth);
      if (!seen.inside()) continue;
      AopConstraint constraint = MakeAopConstraint(source.view->polar(seen.u, seen.v), seen.x, seen.y);
      constraint.diffuse = source.rotation.transpose() * constraint.diffuse;
      constraint.specular = source.rotation.transpose() * constraint.specular;
      constraints[count++] = constraint;
    }
    return NormalFromAop({constraints.data(), count}, labels, start.normal, pixel.ray);
  }

  float PolarizationTerm(const Pixel& pixel, const Hypothesis& hypothesis,
                         const SeenBy& seen) const {  // F_pol, eq. (6)
    PolarimetricCost cost(normalised_polarization_);
    const PolarSample& own = problem_.reference->polar(pixel.x, pixel.y);
    cost.Add(own, residual_(own, hypothesis.normal, pixel.ray.x(), pixel.ray.y()), 1);
    for (const Pixel::Drawn& drawn : pixel.Sources()) {
      const Seen& there = seen[drawn.source];
      if (!there.inside()) continue;
      const Source& source = problem_.sources[drawn.source];
      const PolarSample& sample = source.view->polar(there.u, there.v);
      const Eigen::Vector3f normal = source.rotation * hypothesis.normal;
      cost.Add(sample, residual_(sample, normal, there.x, there.y), drawn.count);
    }
    return cost.Value();
  }

  float DepthNormalTerm(const Pixel& pixel, const Hypothesis& hypothesis) const {  // F_dep, eq. (9)
    if (options_.depth_normal_form == "relative")
      return DepthNormalRelative(hypothesis, pixel.ray, pixel.neighbours,
                                 float(problem_.reference->camera.fx));
    const Neighbour& beside = pixel.neighbours[pixel.neighbours[2].estimate.depth > 0 ? 2 : 3];
    return DepthNormalAngle(hypothesis, pixel.ray, pixel.neighbours[0], beside);
  }

  bool OutsideHull(const SeenBy& seen) const {
    for (std::size_t s = 0; s < sources_; ++s)
      if (OutsideSilhouette(problem_.sources[s], seen[s])) return true;
    return false;
  }

  // Eq. (2). `known`: the matching costs of this hypothesis if they are known. Gives up, with any value >=
  // bound, once the cost cannot stay below it: every term is non-negative.
  float Cost(const Pixel& pixel, const Hypothesis& hypothesis, const float* known, float bound) const {
    float cost = 0;
    if (options_.depth_normal)
      cost += float(options_.depth_normal_weight) * DepthNormalTerm(pixel, hypothesis);
    if (cost >= bound) return cost;
    SeenBy seen;
    if (silhouettes_)
      for (std::size_t s = 0; s < sources_; ++s) seen[s] = Look(pixel, s, hypothesis.depth);
    else if (polarized_ || geometric_)
      for (const Pixel::Drawn& d : pixel.Sources()) seen[d.source] = Look(pixel, d.source, hypothesis.depth);
    if (silhouettes_ && OutsideHull(seen)) cost += 1;
    if (polarized_) cost += float(options_.polarization_weight) * PolarizationTerm(pixel, hypothesis, seen);
    if (geometric_)
      for (const Pixel::Drawn& d : pixel.Sources())
        cost += d.share * float(options_.geometric_weight) * 0.5f *
                GeometricError(problem_.reference->camera, problem_.sources[d.source], seen[d.source],
                               pixel.ray, float(options_.geometric_max_px));
    const float photometric_weight =
        geometric_ ? 1 + float(options_.geometric_weight) : 1;  // F_pho + tau_geo F_geo
    for (const Pixel::Drawn& d : pixel.Sources()) {
      if (cost >= bound) break;
      cost += d.share * photometric_weight * (known ? known[d.source] : Match(pixel, hypothesis, d.source));
    }
    return cost;
  }

  const Problem& problem_;
  const StereoOptions& options_;
  const Image<DepthInterval>& hull_;
  const Sweep& sweep_;
  MatchState& state_;
  const DepthNormalMap before_;
  const Window window_;
  const PatchReader reader_;
  const Visibility visibility_;
  const SourcePrior prior_;
  const PolarizationResidual residual_;
  const std::size_t sources_;
  const bool geometric_, polarized_, silhouettes_, normalised_polarization_;
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
      Random random = PixelRandom(problem, options, x, y, -1);
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
      Pixel pixel;
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
