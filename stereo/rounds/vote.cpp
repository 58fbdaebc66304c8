// SPDX-License-Identifier: Apache-2.0
#include "stereo/rounds/vote.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace polarscan {
namespace {

constexpr float kLeastSupport = 1.0f;  // of a nearer mode: less is chance
constexpr float kReach = 0.7f;         // pixels around its centre that a piece of surface covers

struct Ballot {
  float depth = 0, weight = 0;
};

// A depth found where nothing can be seen counts little, so that chance does not become a surface.
float Weight(const StereoView& view, int x, int y) {
  return view.evidence.empty() ? 1 : std::max(0.05f, view.evidence(x, y));
}

// What one source says at a pixel: the nearest and the farthest piece of its surface there. Both, because a
// wrong depth in front must not hide the right one behind it.
struct Opinion {
  Ballot near_by, far_off;
};

// Columns [left, right) and rows [top, bottom).
struct WorldBox {
  int left, top, right, bottom;
};

WorldBox AroundActive(const Problem& problem, int width, int height) {
  WorldBox box{width, height, 0, 0};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (problem.Active(x, y)) {
        box.left = std::min(box.left, x), box.right = std::max(box.right, x + 1);
        box.top = std::min(box.top, y), box.bottom = y + 1;
      }
  return box;
}

// The source's surface as the reference camera would see it, in that part of the picture. weight: cosine of
// the angle at which the source sees it.
Image<Opinion> DrawSurface(const Problem& problem, const Source& source, const WorldBox& box,
                           bool by_evidence) {
  const Pinhole& camera = problem.reference->camera;
  const Pinhole& from = source.view->camera;
  Image<Opinion> drawn(box.right - box.left, box.bottom - box.top);
  const Eigen::Matrix3f back = source.rotation.transpose();
  const Eigen::Vector3f origin = -(back * source.translation);
  const float fx = float(camera.fx), fy = float(camera.fy), cx = float(camera.cx), cy = float(camera.cy);
  for (int y = 0; y < from.height; ++y)
    for (int x = 0; x < from.width; ++x) {
      const float depth = source.map->depth(x, y);
      if (depth <= 0) continue;
      const Eigen::Vector3f ray((float(x) + 0.5f - source.cx) / source.fx,
                                (float(y) + 0.5f - source.cy) / source.fy, 1);
      const Eigen::Vector3f point = back * (depth * ray) + origin;
      const Eigen::Vector3f normal = back * source.map->normal(x, y);
      const float facing = normal.dot(point);
      if (point.z() <= 0 || facing > -0.05f * point.norm()) continue;
      const float weight =
          (by_evidence ? Weight(*source.view, x, y) : 1) * -source.map->normal(x, y).dot(ray) / ray.norm();
      const float u = fx * point.x() / point.z() + cx, v = fy * point.y() / point.z() + cy;
      const int left = int(std::floor(u - kReach + 0.5f)), right = int(std::floor(u + kReach - 0.5f)),
                top = int(std::floor(v - kReach + 0.5f)), bottom = int(std::floor(v + kReach - 0.5f));
      for (int py = std::max(box.top, top); py <= std::min(bottom, box.bottom - 1); ++py)
        for (int px = std::max(box.left, left); px <= std::min(right, box.right - 1); ++px) {
          if (!problem.Active(px, py)) continue;
          const float z = facing / normal.dot(problem.Ray(px, py));
          if (std::abs(z / point.z() - 1) > 0.02f) continue;
          Opinion& opinion = drawn(px - box.left, py - box.top);
          if (opinion.near_by.depth <= 0 || z < opinion.near_by.depth) opinion.near_by = {z, weight};
          if (z > opinion.far_off.depth) opinion.far_off = {z, weight};
        }
    }
  return drawn;
}

// Support of `depth` by all ballots, and their mean around it. The kernel (1 - t^2/9)^4 is much like
// exp(-t^2/2) and ends at 3 sigma.
Ballot Support(std::span<const Ballot> ballots, float depth, float sigma) {
  float sum = 0, mean = 0;
  const float scale = 1 / (3 * sigma);
  for (const Ballot& b : ballots) {
    const float away = b.depth - depth, t = away * scale;
    const float bell = std::max(0.0f, 1 - t * t), weight = b.weight * (bell * bell) * (bell * bell);
    sum += weight, mean += weight * away;
  }
  return {sum > 0 ? depth + mean / sum : depth, sum};
}

Ballot MeanShift(std::span<const Ballot> ballots, Ballot mode, float relative_sigma) {
  for (int i = 0; i < 6; ++i) {
    const float before = mode.depth;
    mode = Support(ballots, before, relative_sigma * before);
    if (std::abs(mode.depth - before) < 0.01f * relative_sigma * before) break;
  }
  return mode;
}

// Weight of the sources that see something behind a point of the reference's frame, that is, through it.
float SeenThrough(const Problem& problem, const Eigen::Vector3f& point, float relative_sigma) {
  float sum = 0;
  for (const Source& source : problem.sources) {
    const Eigen::Vector3f seen = source.rotation * point + source.translation;
    if (seen.z() <= 0) continue;
    const int x = int(std::floor(source.fx * seen.x() / seen.z() + source.cx)),
              y = int(std::floor(source.fy * seen.y() / seen.z() + source.cy));
    const Image<float>& depth = source.map->depth;
    if (x < 0 || y < 0 || x >= depth.width() || y >= depth.height()) continue;
    if (depth(x, y) <= seen.z() * (1 + 3 * relative_sigma)) continue;
    sum += Weight(*source.view, x, y) * std::max(0.0f, -source.map->normal(x, y).dot(seen) / seen.norm());
  }
  return sum;
}

Ballot NearestMode(std::span<Ballot> ballots, const VoteOptions& options, const Problem& problem,
                   const Eigen::Vector3f& ray) {
  std::ranges::sort(ballots, {}, &Ballot::depth);
  float best = 0;
  std::vector<float> supports(ballots.size());
  for (std::size_t i = 0; i < ballots.size(); ++i) {
    supports[i] = Support(ballots, ballots[i].depth, options.sigma * ballots[i].depth).weight;
    best = std::max(best, supports[i]);
  }
  float asked = 0;  // the last mode that was asked for
  for (std::size_t i = 0; i < ballots.size(); ++i) {
    if (supports[i] >= options.min_support * best) return MeanShift(ballots, ballots[i], options.sigma);
    if (options.trust <= 0 || supports[i] < kLeastSupport) continue;
    const Ballot mode = MeanShift(ballots, ballots[i], options.sigma);
    if (mode.depth <= asked * (1 + options.sigma)) continue;
    asked = mode.depth;
    if (mode.weight >= options.trust * SeenThrough(problem, mode.depth * ray, options.sigma)) return mode;
  }
  return {};  // not reached: one of them has the best support
}

// f(x, y, ballots) for every active pixel of which there are any: what the sources' surfaces and the own map
// say. by_evidence: weighted by what there was to see, too.
template <class F>
void ForBallots(const Problem& problem, const DepthNormalMap& own, float sigma, bool by_evidence, F&& f) {
  const WorldBox box = AroundActive(problem, own.depth.width(), own.depth.height());
  if (box.right <= box.left) return;
  std::vector<Image<Opinion>> surfaces(problem.sources.size());
  ParallelFor(0, int(surfaces.size()), [&](int s) {
    surfaces[std::size_t(s)] = DrawSurface(problem, problem.sources[std::size_t(s)], box, by_evidence);
  });
  ParallelFor(box.top, box.bottom, [&](int y) {
    std::vector<Ballot> ballots;
    for (int x = box.left; x < box.right; ++x) {
      if (!problem.Active(x, y)) continue;
      ballots.clear();
      const Eigen::Vector3f ray = problem.Ray(x, y);
      if (own.depth(x, y) > 0)
        ballots.push_back({own.depth(x, y), (by_evidence ? Weight(*problem.reference, x, y) : 1) *
                                                -own.normal(x, y).dot(ray) / ray.norm()});
      for (const Image<Opinion>& surface : surfaces) {
        const Opinion& opinion = surface(x - box.left, y - box.top);
        if (opinion.near_by.depth <= 0) continue;
        ballots.push_back(opinion.near_by);
        if (opinion.far_off.depth > opinion.near_by.depth * (1 + 3 * sigma))
          ballots.push_back(opinion.far_off);
      }
      if (!ballots.empty()) f(x, y, std::span(ballots));
    }
  });
}

}  // namespace

Vote VoteForDepth(const Problem& problem, const DepthNormalMap& own, const VoteOptions& options) {
  Vote vote{Image<float>(own.depth.width(), own.depth.height()),
            Image<float>(own.depth.width(), own.depth.height())};
  ForBallots(problem, own, options.sigma, true, [&](int x, int y, std::span<Ballot> ballots) {
    const Ballot mode = NearestMode(ballots, options, problem, problem.Ray(x, y));
    vote.depth(x, y) = mode.depth, vote.confidence(x, y) = mode.weight;
  });
  return vote;
}

Image<float> SupportOf(const Image<float>& depth, const Problem& problem, const DepthNormalMap& own,
                       float sigma) {
  Image<float> support(depth.width(), depth.height());
  ForBallots(problem, own, sigma, false, [&](int x, int y, std::span<Ballot> ballots) {
    if (depth(x, y) > 0) support(x, y) = Support(ballots, depth(x, y), sigma * depth(x, y)).weight;
  });
  return support;
}

}  // namespace polarscan
