// SPDX-License-Identifier: Apache-2.0
#include "fusion/fuse.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/files.h"
#include "fusion/cloud.h"
#include "fusion/fuse_view.h"
#include "fusion/overlap.h"

namespace polarscan {
namespace {

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

// One run: the state that lasts from view to view.
class Fusion {
 public:
  Fusion(const Workspace& workspace, const FusionOptions& options, Progress& progress)
      : workspace_(workspace),
        options_(options),
        progress_(progress),
        kind_(options.maps == "auto" ? BestMapKind(workspace) : options.maps),
        cache_(workspace, kind_, options.masks, std::size_t(options.memory_gb * 1e9)),
        usable_(UsableViews(workspace, kind_, progress)),
        absorbed_(workspace.views.size()) {
    if (Usable() == 0)
      throw Error(fmt::format("no view has {} maps", kind_), (workspace.folder / "stereo").string(),
                  "Run polarscan stereo first");
    if (MinViews() < options.min_views)
      progress.Warn(
          fmt::format("only {} views have depth maps; a point needs the agreement of {} instead of {}",
                      Usable(), MinViews(), options.min_views));
  }

  void Run(CloudWriter& cloud) {
    progress_.Begin("fusion", std::size_t(Usable()));
    for (int i = 0; i < int(workspace_.views.size()); ++i) {
      if (!usable_[std::size_t(i)]) continue;
      progress_.Check();
      if (const auto reference = Load(i)) FuseOne(i, *reference, cloud);
      progress_.Advance();
    }
    summary_.views = Usable();
    summary_.maps = kind_;
    summary_.points = summary_.counts.points = cloud.points();
    if (cloud.points() == 0) ThrowNothing();
    const double n = double(cloud.points());
    summary_.mean_views /= n, summary_.mean_confidence /= n, summary_.mean_dop /= n;
  }

  const CloudSummary& summary() const { return summary_; }

 private:
  int Usable() const { return int(std::ranges::count(usable_, true)); }
  int MinViews() const { return std::min(options_.min_views, Usable()); }

  // The view's maps; nothing if they are damaged: then the view is left out from here on.
  std::shared_ptr<const ViewMaps> Load(int view) {
    try {
      auto maps = cache_.Get(view);
      absorbed_.Prepare(view, maps->depth);
      return maps;
    } catch (const Error& error) {
      const std::string& name = workspace_.views[std::size_t(view)].name;
      usable_[std::size_t(view)] = false;
      summary_.damaged.push_back(name);
      progress_.Warn(fmt::format("view {} is damaged and left out: {}", name, error.what()));
      return nullptr;
    }
  }

  // Anew from the start when one of them turns out to be damaged, as if it had never been there.
  Candidates FindCandidates(int view, const ViewMaps& reference) {
    Candidates candidates;
    candidates.views = OverlappingViews(workspace_, view, reference, usable_, options_.check_views);
    for (int other : candidates.views) {
      candidates.maps.push_back(Load(other));
      if (!candidates.maps.back()) return FindCandidates(view, reference);
    }
    return candidates;
  }

  void FuseOne(int view, const ViewMaps& reference, CloudWriter& cloud) {
    FusionCounts& counts = summary_.counts;
    counts.with_depth += reference.pixels_with_depth;
    counts.masked += reference.pixels_masked;
    counts.without_normal += reference.pixels_without_normal;
    const Candidates candidates = FindCandidates(view, reference);
    const auto sink = [&](const std::vector<CloudPoint>& points) {
      for (const CloudPoint& p : points) {
        summary_.mean_views += p.views;
        summary_.mean_confidence += double(p.confidence);
        summary_.mean_dop += double(p.dop);
      }
      cloud.Add(points);
    };
    FuseView(reference, view, candidates, MinViews(), options_, absorbed_, counts, sink, progress_);
  }

  [[noreturn]] void ThrowNothing() const {
    throw Error("nothing to fuse: " + Explain(summary_.counts, MinViews()), workspace_.folder.string(),
                "Check the poses and the depth maps (polarscan report), or loosen --fusion-min-views, "
                "--fusion-reprojection, --fusion-depth or --fusion-normal");
  }

  const Workspace& workspace_;
  const FusionOptions& options_;
  Progress& progress_;
  std::string kind_;
  MapCache cache_;
  std::vector<bool> usable_;
  AbsorbedPixels absorbed_;
  CloudSummary summary_;
};

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
          {"damaged", s.damaged.size()},
          {"damaged_views", s.damaged},
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
  Fusion fusion(workspace, options, progress);
  WriteAtomically(cloud_ply, [&](const std::filesystem::path& temporary) {
    CloudWriter cloud(
        temporary,
        "confidence = 1 - exp(-sum of sin(angle to the first view) (1 - residual) over the agreeing views)");
    fusion.Run(cloud);
    cloud.Finish();
  });
  return fusion.summary();
}

}  // namespace polarscan
