// SPDX-License-Identifier: Apache-2.0
#include "stereo/rounds/surface_matching.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "stereo/rounds/band_rows.h"

namespace polarscan {
namespace {

constexpr int kBandRows = 32;
constexpr float kHidden =
    0.01f;  // share of the depth by which a source's surface must be nearer to hide a point
constexpr float kLeastFacing = 0.15f;  // cosine at which a source sees too little of the surface
constexpr float kLeastWindow = 0.4f;   // share of a window's weight that a source must see
constexpr float kSharpnessFloor = 0.02f;

// Rows [begin, end) of the picture and a margin for the windows around them; columns [left, right) hold all
// pixels that count.
struct MatchingBand {
  int begin, end, top, bottom, left = 0, right = 0;
  int width() const { return right - left; }
};

// exp(-r^2 / 2 sigma^2) by r^2, for offsets of up to 2 sigma in x and y.
std::vector<float> GaussianBySquare(float sigma) {
  const int reach = int(std::ceil(2 * sigma));
  std::vector<float> values;
  for (int square = 0; square <= 2 * reach * reach; ++square)
    values.push_back(std::exp(-0.5f / (sigma * sigma) * float(square)));
  return values;
}

std::vector<float> GaussianTaps(float sigma) {
  std::vector<float> taps;
  float sum = 0;
  for (int i = 0; i <= int(std::ceil(2 * sigma)); ++i) {
    taps.push_back(std::exp(-0.5f * float(i * i) / (sigma * sigma)));
    sum += i == 0 ? taps[0] : 2 * taps.back();
  }
  for (float& tap : taps) tap /= sum;
  return taps;
}

class SurfaceMatcher {
 public:
  SurfaceMatcher(const Problem& problem, const DepthNormalMap& own, const SurfaceMatchingOptions& options)
      : problem_(problem),
        own_(own),
        options_(options),
        width_(own.depth.width()),
        height_(own.depth.height()),
        taps_(GaussianTaps(options.window_px)),
        smoothing_(GaussianBySquare(options.smoothing_px)),
        step_(StepSize()),
        scales_(Scales()),
        moves_(width_, height_),
        sharpness_(width_, height_) {}

  Image<float> Run() {
    if (step_ <= 0 || problem_.sources.empty()) return own_.depth;
    ParallelFor(0, (height_ + kBandRows - 1) / kBandRows, [&](int i) { MatchBand(MakeBand(i * kBandRows)); });
    Image<float> depth = own_.depth;
    ParallelFor(0, height_, [&](int y) {
      for (int x = 0; x < width_; ++x)
        if (Counts(x, y)) depth(x, y) *= std::exp(step_ * SmoothMove(x, y));
    });
    return depth;
  }

 private:
  int Steps() const { return 2 * options_.steps + 1; }
  bool Counts(int x, int y) const { return own_.depth(x, y) > 0 && problem_.Active(x, y); }

  // Pixels that a point moves in a source for a small relative change of its depth.
  static float Motion(const Source& source, const Eigen::Vector3f& point) {
    const Eigen::Vector3f turned = source.rotation * point, there = turned + source.translation;
    if (there.z() <= 0) return 0;
    const float x = there.x() / there.z(), y = there.y() / there.z();
    return std::hypot(source.fx * (turned.x() - x * turned.z()), source.fy * (turned.y() - y * turned.z())) /
           there.z();
  }

  // The step in log depth: the median motion over a sample of pixels and all sources is step_px.
  float StepSize() const {
    std::vector<float> motions;
    for (int y = 3; y < height_; y += 7)
      for (int x = 3; x < width_; x += 7)
        if (Counts(x, y))
          for (const Source& source : problem_.sources)
            motions.push_back(Motion(source, own_.depth(x, y) * problem_.Ray(x, y)));
    if (motions.empty()) return 0;
    const auto middle = motions.begin() + std::ptrdiff_t(motions.size() / 2);
    std::nth_element(motions.begin(), middle, motions.end());
    return *middle > 0 ? options_.step_px / *middle : 0;
  }

  // Whether the source sees the point at all of its steps.
  bool Sees(const Source& source, const Eigen::Vector3f& turned, int x, int y) const {
    const Image<float>& gray = source.view->gray;
    for (const float scale : {scales_.front(), scales_.back()}) {
      const Eigen::Vector3f p = scale * turned + source.translation;
      if (p.z() <= 0) return false;
      const float u = source.fx * p.x() / p.z() + source.cx, v = source.fy * p.y() / p.z() + source.cy;
      if (!(u >= 0.5f && v >= 0.5f && u < float(gray.width()) - 0.5f && v < float(gray.height()) - 0.5f))
        return false;
    }
    const Eigen::Vector3f there = turned + source.translation;
    if (-(source.rotation * own_.normal(x, y)).dot(there) < kLeastFacing * there.norm()) return false;
    if (!source.map) return true;
    const Seen seen = LookAt(source, there);
    const float surface = source.map->depth(seen.u, seen.v);
    return surface <= 0 || surface > there.z() * (1 - kHidden);
  }

  std::vector<float> Scales() const {
    std::vector<float> scales;
    for (int k = 0; k < Steps(); ++k) scales.push_back(std::exp(step_ * float(k - options_.steps)));
    return scales;
  }

  MatchingBand MakeBand(int begin) const {
    const int reach = int(taps_.size()) - 1, end = std::min(begin + kBandRows, height_);
    MatchingBand band{begin, end, std::max(0, begin - reach), std::min(height_, end + reach), width_, 0};
    for (int y = band.top; y < band.bottom; ++y)
      for (int x = 0; x < width_; ++x)
        if (Counts(x, y)) band.left = std::min(band.left, x), band.right = std::max(band.right, x + 1);
    return band;
  }

  void MatchBand(const MatchingBand& band) {
    if (band.width() <= 0) return;
    const std::size_t count = problem_.sources.size(), steps = std::size_t(Steps());
    const std::size_t pixels = std::size_t(band.end - band.begin) * std::size_t(band.width());
    std::vector<float> costs(pixels * count * steps, 2.0f);  // by pixel, source, step
    Planes planes(BandPlane(band.top, band.bottom, band.width()));
    for (std::size_t s = 0; s < count; ++s)
      MatchSource(band, problem_.sources[s], planes, &costs[s * steps], count * steps);
    std::vector<std::pair<float, const float*>> order(count);
    for (std::size_t i = 0; i < pixels; ++i) {
      const int x = band.left + int(i) % band.width(), y = band.begin + int(i) / band.width();
      if (!Counts(x, y)) continue;
      for (std::size_t s = 0; s < count; ++s) {
        const float* curve = &costs[(i * count + s) * steps];
        order[s] = {*std::min_element(curve, curve + steps), curve};
      }
      Choose(order, x, y);
    }
  }

  // What a band needs while it is matched with one source after the other.
  struct Planes {
    BandPlane x, y, z, seen;  // the points turned into the source's axes, and which of them it sees
    BandPlane r, s, scratch;
    BandPlane sum_w, sum_r, sum_rr, sum_s, sum_ss, sum_rs;
    BandPlane one;
    std::vector<float> cost;

    explicit Planes(const BandPlane& b)
        : x(b),
          y(b),
          z(b),
          seen(b),
          r(b),
          s(b),
          scratch(b),
          sum_w(b),
          sum_r(b),
          sum_rr(b),
          sum_s(b),
          sum_ss(b),
          sum_rs(b),
          one(b),
          cost(std::size_t(b.width()) + BandPlane::kMargin) {
      for (int row = b.top(); row < b.bottom(); ++row) std::fill_n(one.Row(row), b.width(), 1.0f);
    }
  };

  bool ToSource(const MatchingBand& band, const Source& source, Planes& planes) const {
    bool any = false;
    for (int y = band.top; y < band.bottom; ++y) {
      float *px = planes.x.Row(y), *py = planes.y.Row(y), *pz = planes.z.Row(y), *seen = planes.seen.Row(y),
            *r = planes.r.Row(y);
      for (int x = band.left, i = 0; x < band.right; ++x, ++i) {
        seen[i] = r[i] = 0;
        if (!Counts(x, y)) continue;
        const Eigen::Vector3f point = source.rotation * (own_.depth(x, y) * problem_.Ray(x, y));
        if (!Sees(source, point, x, y)) continue;
        px[i] = point.x(), py[i] = point.y(), pz[i] = point.z();
        seen[i] = 1, r[i] = problem_.reference->gray(x, y) - 0.5f;
        any = true;
      }
    }
    return any;
  }

  // 1 - NCC of all pixels and steps with one source; costs[0] is the band's first pixel's first step.
  void MatchSource(const MatchingBand& band, const Source& source, Planes& p, float* costs,
                   std::size_t stride) const {
    if (!ToSource(band, source, p)) return;
    const auto sums = [&](const BandPlane& a, const BandPlane& b, BandPlane& out) {
      WindowSums(a, b, taps_, band.begin, band.end, p.scratch, out);
    };
    sums(p.seen, p.one, p.sum_w);
    sums(p.r, p.one, p.sum_r);
    sums(p.r, p.r, p.sum_rr);
    const Eigen::Vector3f& t = source.translation;
    const RowCamera camera{source.fx, source.fy, source.cx, source.cy, t.x(), t.y(), t.z()};
    for (int k = 0; k < Steps(); ++k) {
      for (int y = band.top; y < band.bottom; ++y)
        DrawRow(source.view->gray, camera, scales_[std::size_t(k)], p.x.Row(y), p.y.Row(y), p.z.Row(y),
                p.seen.Row(y), band.width(), p.s.Row(y));
      sums(p.s, p.one, p.sum_s);
      sums(p.s, p.s, p.sum_ss);
      sums(p.r, p.s, p.sum_rs);
      float* cost = costs + k;
      for (int y = band.begin; y < band.end; ++y) {
        MatchingCostRow({p.sum_w.Row(y), p.sum_r.Row(y), p.sum_rr.Row(y), p.sum_s.Row(y), p.sum_ss.Row(y),
                         p.sum_rs.Row(y)},
                        options_.epsilon, band.width(), p.cost.data());
        for (int i = 0; i < band.width(); ++i, cost += stride)
          if (p.seen.Row(y)[i] > 0 && p.sum_w.Row(y)[i] >= kLeastWindow) *cost = p.cost[std::size_t(i)];
      }
    }
  }

  // The pixel's best step and how sharp the minimum is.
  void Choose(std::vector<std::pair<float, const float*>>& order, int x, int y) {
    const int steps = Steps();
    std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
      return a.first < b.first || (a.first == b.first && a.second < b.second);
    });
    std::vector<float> curve(std::size_t(steps), 0.0f);
    int chosen = 0;
    for (const auto& [best, costs] : order) {
      if (best >= 1 || chosen == options_.chosen_sources) break;
      for (int k = 0; k < steps; ++k) curve[std::size_t(k)] += costs[k];
      ++chosen;
    }
    if (chosen == 0) return;
    const int k = int(std::min_element(curve.begin(), curve.end()) - curve.begin());
    const float share = 1 / float(options_.chosen_sources);
    if (k == 0 || k == steps - 1) {
      moves_(x, y) = float(k - options_.steps);
      sharpness_(x, y) = share * (curve[std::size_t(k ? k - 1 : 1)] - curve[std::size_t(k)]);
      return;
    }
    const float before = curve[std::size_t(k - 1)], at = curve[std::size_t(k)],
                after = curve[std::size_t(k + 1)];
    const float bend = before + after - 2 * at;
    moves_(x, y) = float(k - options_.steps) + (bend > 0 ? 0.5f * (before - after) / bend : 0);
    sharpness_(x, y) = share * bend;
  }

  float SmoothMove(int x, int y) const {
    const int reach = int(std::ceil(2 * options_.smoothing_px));
    const Eigen::Vector3f ray = problem_.Ray(x, y);
    const Eigen::Vector3f& normal = own_.normal(x, y);
    const float plane = own_.depth(x, y) * normal.dot(ray), far = step_ * float(Steps());
    float sum = 0, weights = kSharpnessFloor;
    for (int v = y - reach; v <= y + reach; v += 2)  // every second: neighbours share nearly all of a window
      for (int u = x - reach; u <= x + reach; u += 2) {
        if (!sharpness_.Contains(u, v) || sharpness_(u, v) <= 0) continue;
        const float there = plane / normal.dot(problem_.Ray(u, v));
        if (std::abs(own_.depth(u, v) - there) > far * there) continue;  // another surface
        const int square = (u - x) * (u - x) + (v - y) * (v - y);
        const float weight = sharpness_(u, v) * smoothing_[std::size_t(square)];
        sum += weight * moves_(u, v), weights += weight;
      }
    return sum / weights;
  }

  const Problem& problem_;
  const DepthNormalMap& own_;
  const SurfaceMatchingOptions& options_;
  const int width_, height_;
  const std::vector<float> taps_, smoothing_;
  const float step_;                 // in log depth
  const std::vector<float> scales_;  // of the depth, step by step
  Image<float> moves_, sharpness_;   // in steps
};

}  // namespace

Image<float> MatchSurface(const Problem& problem, const DepthNormalMap& own,
                          const SurfaceMatchingOptions& options) {
  return SurfaceMatcher(problem, own, options).Run();
}

}  // namespace polarscan
