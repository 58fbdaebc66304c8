// SPDX-License-Identifier: Apache-2.0
#include "fusion/cloud/fuse_view.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/parallel.h"

namespace polarscan {
namespace {

constexpr int kBandRows = 32;

struct AbsorbedPixel {
  std::uint32_t candidate, pixel;
};

struct Row {
  std::vector<CloudPoint> points;
  std::vector<AbsorbedPixel> absorbed;
  FusionCounts counts;
};

ConsistencyLimits Limits(const FusionOptions& options) {
  return {options.reprojection_px, options.relative_depth, options.normal_deg};
}

// A view that sees the surface about as finely as the first one, or more coarsely, has nothing to add around
// the point: the four pixels around its projection are absorbed. Of a finer view only the pixel that was
// asked is, and the others may still become points.
void Absorb(const ViewMaps& view, const Agreement& agreement, double patch_area, double relative_depth,
            Row& row) {
  constexpr double kFiner = 2;
  const float depth = view.depth(agreement.x, agreement.y);
  const bool finer = patch_area > kFiner * PatchArea(view, agreement.x, agreement.y);
  const int left = int(std::floor(agreement.pixel.x() - 0.5)),
            top = int(std::floor(agreement.pixel.y() - 0.5));
  for (int y = top; y <= top + 1; ++y)
    for (int x = left; x <= left + 1; ++x) {
      const bool asked = x == agreement.x && y == agreement.y;
      if ((finer && !asked) || !view.depth.Contains(x, y)) continue;
      if (std::abs(view.depth(x, y) - depth) > relative_depth * depth) continue;
      row.absorbed.push_back({std::uint32_t(agreement.view), std::uint32_t(y * view.depth.width() + x)});
    }
}

Row FuseRow(const ViewMaps& reference, int view, int y, const Candidates& candidates,
            const AbsorbedPixels& absorbed, int min_views, const FusionOptions& options) {
  const ConsistencyLimits limits = Limits(options);
  Row row;
  std::vector<Agreement> agreements;
  for (int x = 0; x < reference.depth.width(); ++x) {
    if (reference.depth(x, y) == 0) continue;
    if (absorbed.Has(view, std::size_t(y) * std::size_t(reference.depth.width()) + std::size_t(x))) {
      ++row.counts.absorbed;
      continue;
    }
    ConsistencyCounts asked;
    FindAgreements(reference, x, y, candidates.maps, candidates.places, limits, agreements, asked);
    const std::size_t agreeing = PlacesOf(agreements);
    row.counts.asked += asked;
    if (int(agreeing) + 1 < min_views) {
      ++row.counts.too_few_views;
    } else if (options.contradictions > 0 &&
               double(asked.seen_through) > options.contradictions * double(agreeing)) {
      ++row.counts.contradicted;
    } else {
      row.points.push_back(FusePixel(reference, x, y, candidates.maps, agreements));
      const double area = PatchArea(reference, x, y);
      for (const Agreement& a : agreements)
        Absorb(*candidates.maps[std::size_t(a.view)], a, area, limits.relative_depth, row);
    }
  }
  return row;
}

void Add(FusionCounts& sum, const FusionCounts& row) {
  sum.absorbed += row.absorbed;
  sum.too_few_views += row.too_few_views;
  sum.contradicted += row.contradicted;
  sum.asked += row.asked;
}

}  // namespace

void FuseView(const ViewMaps& reference, int view, const Candidates& candidates, int min_views,
              const FusionOptions& options, AbsorbedPixels& absorbed, FusionCounts& counts,
              const PointSink& sink, Progress& progress) {
  for (int top = 0; top < reference.depth.height(); top += kBandRows) {
    std::vector<Row> rows(std::size_t(std::min(kBandRows, reference.depth.height() - top)));
    ParallelFor(0, int(rows.size()), [&](int i) {
      progress.Check();
      rows[std::size_t(i)] = FuseRow(reference, view, top + i, candidates, absorbed, min_views, options);
    });
    for (const Row& row : rows) {
      sink(row.points);
      for (const auto& [candidate, pixel] : row.absorbed) absorbed.Add(candidates.views[candidate], pixel);
      Add(counts, row.counts);
    }
  }
}

}  // namespace polarscan
