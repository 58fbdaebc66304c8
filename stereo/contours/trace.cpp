// SPDX-License-Identifier: Apache-2.0
#include "stereo/contours/trace.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel.h"

namespace polarscan {
namespace {

constexpr std::size_t kMostSeeds = 8;

// What a contour meets on one side: u of the seeds, and how far away they are in the mean; none: count 0.
struct ContourEnd {
  std::array<float, kMostSeeds> met{};
  std::size_t count = 0;
  float length = 0;

  float MedianU() {
    std::sort(met.begin(), met.begin() + std::ptrdiff_t(count));
    return (met[(count - 1) / 2] + met[count / 2]) / 2;
  }
};

class Tracer {
 public:
  Tracer(const Problem& problem, const ContourField& field, const Distances& seeds,
         const TraceOptions& options)
      : problem_(problem), field_(field), seeds_(seeds), options_(options) {}

  void Trace(int x, int y, Distances& traced) const {
    const Eigen::Vector2f here = {float(x), float(y)}, doubled = field_.At(here);
    if (doubled.norm() < options_.least_field) return;
    const Eigen::Vector2f along = ContourField::Direction(doubled);
    ContourEnd a = Follow(here, along), b = Follow(here, -along);
    if (a.count == 0) std::swap(a, b);
    if (a.count == 0) return;
    traced.u(x, y) = a.MedianU();
    traced.weight(x, y) = 0.5f * Nearness(a.length);
    if (b.count == 0) return;
    const float ua = a.MedianU(), ub = b.MedianU(), apart = (ua - ub) / options_.disagreement_px;
    traced.u(x, y) = (ua * b.length + ub * a.length) / (a.length + b.length);
    traced.weight(x, y) = Nearness(std::min(a.length, b.length)) / (1 + apart * apart);
  }

 private:
  float Nearness(float length) const {
    const float share = length / options_.reach_px;
    return 1 / (1 + share * share);
  }

  // The contour's direction at a place, turned as `along` is; zero: it ends there.
  Eigen::Vector2f DirectionAt(const Eigen::Vector2f& place, const Eigen::Vector2f& along) const {
    const Eigen::Vector2f doubled = field_.At(place);
    if (doubled.norm() < options_.least_field) return Eigen::Vector2f::Zero();
    const Eigen::Vector2f direction = ContourField::Direction(doubled);
    return direction.dot(along) < 0 ? Eigen::Vector2f(-direction) : direction;
  }

  // Between four seeds bilinear; else that of the nearest pixel (x, y).
  float SeedAt(const Eigen::Vector2f& place, int x, int y) const {
    const int left = int(std::floor(place.x())), top = int(std::floor(place.y()));
    if (!seeds_.u.Contains(left, top) || !seeds_.u.Contains(left + 1, top + 1)) return seeds_.u(x, y);
    const Image<float>& weight = seeds_.weight;
    const bool all = weight(left, top) > 0 && weight(left + 1, top) > 0 && weight(left, top + 1) > 0 &&
                     weight(left + 1, top + 1) > 0;
    return all ? *Bilinear(seeds_.u, place.x() + 0.5, place.y() + 0.5) : seeds_.u(x, y);
  }

  ContourEnd Follow(Eigen::Vector2f place, Eigen::Vector2f along) const {
    ContourEnd end;
    for (float length = 1; length <= options_.longest_px; ++length) {
      const Eigen::Vector2f half = DirectionAt(place, along);
      along = DirectionAt(place + 0.5f * half, half);
      if (half.isZero() || along.isZero()) break;
      place += along;
      const int x = int(std::lround(place.x())), y = int(std::lround(place.y()));
      if (!seeds_.u.Contains(x, y) || !problem_.Active(x, y)) break;
      if (seeds_.weight(x, y) <= 0) continue;
      end.met[end.count++] = SeedAt(place, x, y);
      end.length += length;
      if (end.count == std::min(kMostSeeds, std::size_t(options_.seeds))) break;
    }
    if (end.count > 0) end.length /= float(end.count);
    return end;
  }

  const Problem& problem_;
  const ContourField& field_;
  const Distances& seeds_;
  const TraceOptions& options_;
};

}  // namespace

Distances TraceContours(const Problem& problem, const ContourField& field, const Distances& seeds,
                        const TraceOptions& options) {
  const Tracer tracer(problem, field, seeds, options);
  Distances traced = seeds;
  ParallelFor(0, traced.u.height(), [&](int y) {
    for (int x = 0; x < traced.u.width(); ++x)
      if (problem.Active(x, y) && seeds.weight(x, y) <= 0) tracer.Trace(x, y, traced);
  });
  return traced;
}

}  // namespace polarscan
