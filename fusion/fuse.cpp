// SPDX-License-Identifier: Apache-2.0
#include "fusion/fuse.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "fusion/cloud.h"
#include "fusion/overlap.h"

namespace polarscan {
namespace {

// Pixels that are part of a point already, one bit a pixel. They begin no point of their own, but still bear
// witness.
class AbsorbedPixels {
 public:
  explicit AbsorbedPixels(std::size_t views) : views_(views) {}
  void Prepare(int view, const Image<float>& depth) {
    if (views_[std::size_t(view)].empty()) views_[std::size_t(view)].resize(depth.size());
  }
  bool Has(int view, std::size_t pixel) const { return views_[std::size_t(view)][pixel]; }
  void Add(int view, std::size_t pixel) { views_[std::size_t(view)][pixel] = true; }

 private:
  std::vector<std::vector<bool>> views_;
};

struct Candidates {
  std::vector<int> views;  // indices into the workspace
  std::vector<std::shared_ptr<const ViewMaps>> maps;
};

struct Row {
  std::vector<CloudPoint> points;
  std::vector<std::pair<int, std::size_t>> absorbed;  // (candidate, pixel)
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
      row.absorbed.emplace_back(agreement.view,
                                std::size_t(y) * std::size_t(view.depth.width()) + std::size_t(x));
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
    FindAgreements(reference, x, y, candidates.maps, limits, agreements, asked);
    row.counts.asked += asked;
    if (int(agreements.size()) + 1 < min_views) {
      ++row.counts.too_few_views;
    } else if (options.contradictions > 0 &&
               double(asked.seen_through) > options.contradictions * double(agreements.size())) {
      ++row.counts.contradicted;
    } else {
      row.points.push_back(Fuse(reference, x, y, candidates.maps, agreements));
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

// The state of one run: everything that lasts from view to view.
struct Fusion {
  const Workspace& workspace;
  const FusionOptions& options;
  MapCache cache;
  std::vector<bool> usable;
  AbsorbedPixels absorbed;
  int min_views;
  std::vector<CloudPoint> points;
  FusionCounts counts;
};

Candidates FindCandidates(Fusion& fusion, int view, const ViewMaps& reference) {
  Candidates candidates;
  candidates.views =
      OverlappingViews(fusion.workspace, view, reference, fusion.usable, fusion.options.check_views);
  for (int other : candidates.views) {
    candidates.maps.push_back(fusion.cache.Get(other));
    fusion.absorbed.Prepare(other, candidates.maps.back()->depth);
  }
  return candidates;
}

// Rows in parallel, each looking only at what earlier views have absorbed; then merged in order.
void FuseView(Fusion& fusion, int view, Progress& progress) {
  const auto reference = fusion.cache.Get(view);
  fusion.absorbed.Prepare(view, reference->depth);
  fusion.counts.with_depth += reference->pixels_with_depth;
  fusion.counts.masked += reference->pixels_masked;
  fusion.counts.without_normal += reference->pixels_without_normal;
  const Candidates candidates = FindCandidates(fusion, view, *reference);
  std::vector<Row> rows(std::size_t(reference->depth.height()));
  ParallelFor(0, reference->depth.height(), [&](int y) {
    progress.Check();
    rows[std::size_t(y)] =
        FuseRow(*reference, view, y, candidates, fusion.absorbed, fusion.min_views, fusion.options);
  });
  for (const Row& row : rows) {
    fusion.points.insert(fusion.points.end(), row.points.begin(), row.points.end());
    for (const auto& [candidate, pixel] : row.absorbed)
      fusion.absorbed.Add(candidates.views[std::size_t(candidate)], pixel);
    Add(fusion.counts, row.counts);
  }
}

std::vector<bool> UsableViews(const Workspace& workspace, const std::string& kind, Progress& progress) {
  std::vector<bool> usable;
  std::string missing;
  for (int i = 0; i < int(workspace.views.size()); ++i) {
    usable.push_back(HasMaps(workspace, i, kind));
    if (!usable.back()) missing += (missing.empty() ? "" : ", ") + workspace.views[std::size_t(i)].name;
  }
  if (!missing.empty())
    progress.Warn(fmt::format("views without {} depth maps are left out: {}", kind, missing));
  return usable;
}

// Why pixels did not become points, in words.
std::string Explain(const FusionCounts& c, int min_views) {
  return fmt::format(
      "{} pixels have a depth: {} outside of the masks, {} without a normal, {} on which fewer than {} views "
      "agree, "
      "{} contradicted by other views. Of the questions to other views {} fell outside of their pictures, {} "
      "met no "
      "depth, {} another depth, {} failed the reprojection, {} the normals, {} agreed",
      c.with_depth, c.masked, c.without_normal, c.too_few_views, min_views, c.contradicted, c.asked.outside,
      c.asked.no_depth, c.asked.depth, c.asked.reprojection, c.asked.normal, c.asked.agreed);
}

CloudSummary Summarize(const Fusion& fusion, const std::string& kind) {
  CloudSummary summary;
  summary.points = fusion.points.size();
  summary.views = int(std::ranges::count(fusion.usable, true));
  summary.maps = kind;
  summary.counts = fusion.counts;
  const double n = double(std::max<std::size_t>(1, summary.points));
  for (const CloudPoint& p : fusion.points) {
    summary.mean_views += p.views / n;
    summary.mean_confidence += p.confidence / n;
    summary.mean_dop += p.dop / n;
  }
  return summary;
}

}  // namespace

OptionTable Table(FusionOptions& o) {
  return {
      {"fusion-maps",
       &o.maps,
       "Depth maps to fuse; auto: geometric if there are any",
       "",
       0,
       0,
       {"auto", "geometric", "photometric"}},
      {"fusion-min-views", &o.min_views, "Views that must agree on a point; fewer: more points, more strays",
       "views", 1, 1000},
      {"fusion-reprojection", &o.reprojection_px,
       "Greatest distance of two views' points, seen from the first", "px", 0.01, 100},
      {"fusion-depth", &o.relative_depth, "Greatest difference of two views' depths, as a share of the depth",
       "", 1e-6, 1},
      {"fusion-normal", &o.normal_deg, "Greatest angle between two views' normals", "deg", 0.1, 180},
      {"fusion-check-views", &o.check_views, "Views asked about a pixel at most (those that overlap most)",
       "views", 1, 100000},
      {"fusion-contradictions", &o.contradictions,
       "Leave a point out if this many times more views see through it than agree; 0: never", "", 0, 1000},
      {"masks", &o.masks, "Leave out what lies outside of the masks, where there are any"},
      {"fusion-memory", &o.memory_gb, "Memory for maps; with less they are read more often", "GB", 0, 1e6},
  };
}

nlohmann::json ToJson(const CloudSummary& s) {
  const FusionCounts& c = s.counts;
  return {{"points", s.points},
          {"views", s.views},
          {"maps", s.maps},
          {"mean_views", s.mean_views},
          {"mean_confidence", s.mean_confidence},
          {"mean_dop", s.mean_dop},
          {"pixels",
           {{"with_depth", c.with_depth},
            {"masked", c.masked},
            {"without_normal", c.without_normal},
            {"absorbed", c.absorbed},
            {"too_few_views", c.too_few_views},
            {"contradicted", c.contradicted}}}};
}

CloudSummary FuseCloud(const std::filesystem::path& dense, const std::filesystem::path& cloud_ply,
                       const FusionOptions& options, Progress& progress) {
  return FuseCloud(ReadWorkspace(dense), cloud_ply, options, progress);
}

CloudSummary FuseCloud(const Workspace& workspace, const std::filesystem::path& cloud_ply,
                       const FusionOptions& options, Progress& progress) {
  const std::string kind = options.maps == "auto" ? BestMapKind(workspace) : options.maps;
  std::vector<bool> usable = UsableViews(workspace, kind, progress);
  const int views = int(std::ranges::count(usable, true));
  if (views == 0)
    throw Error(fmt::format("no view has {} maps", kind), (workspace.folder / "stereo").string(),
                "Run polarscan stereo first");
  Fusion fusion{workspace,
                options,
                MapCache(workspace, kind, options.masks, std::size_t(options.memory_gb * 1e9)),
                std::move(usable),
                AbsorbedPixels(workspace.views.size()),
                std::min(options.min_views, views),
                {},
                {}};
  if (fusion.min_views < options.min_views)
    progress.Warn(
        fmt::format("only {} views have depth maps; a point needs the agreement of {} instead of {}", views,
                    fusion.min_views, options.min_views));
  progress.Begin("fusion", std::size_t(views));
  for (int i = 0; i < int(workspace.views.size()); ++i) {
    if (!fusion.usable[std::size_t(i)]) continue;
    progress.Check();
    FuseView(fusion, i, progress);
    progress.Advance();
  }
  fusion.counts.points = fusion.points.size();
  if (fusion.points.empty())
    throw Error("nothing to fuse: " + Explain(fusion.counts, fusion.min_views), workspace.folder.string(),
                "Check the poses and the depth maps (polarscan report), or loosen --fusion-min-views, "
                "--fusion-reprojection, --fusion-depth or --fusion-normal");
  WriteCloud(
      cloud_ply, fusion.points,
      "confidence = 1 - exp(-sum of sin(angle to the first view) (1 - residual) over the agreeing views)");
  return Summarize(fusion, kind);
}

}  // namespace polarscan
