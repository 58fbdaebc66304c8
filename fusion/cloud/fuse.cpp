// SPDX-License-Identifier: Apache-2.0
#include "fusion/cloud/fuse.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "core/error.h"
#include "core/files/files.h"
#include "fusion/cloud/cloud.h"
#include "fusion/cloud/fuse_view.h"
#include "fusion/cloud/overlap.h"
#include "stereo/sfm/model/model.h"

namespace polarscan {
namespace {

std::vector<bool> UsableViews(const Workspace& workspace, const MapKind& kind, Progress& progress) {
  std::vector<bool> usable;
  std::string missing;
  for (int i = 0; i < int(workspace.views.size()); ++i) {
    usable.push_back(HasMaps(workspace, i, kind));
    if (!usable.back()) missing += (missing.empty() ? "" : ", ") + workspace.views[std::size_t(i)].name;
  }
  if (!missing.empty())
    progress.Warn(fmt::format("views without {} depth maps are left out: {}", ToString(kind), missing));
  return usable;
}

// Why pixels did not become points, in words.
std::string Explain(const FusionCounts& c, int min_views) {
  return fmt::format(
      "{} pixels have a depth: {} outside of the masks, {} without a normal, {} on which fewer than {} views "
      "agree, {} contradicted by other views. Of the questions to other views {} fell outside of their "
      "pictures, {} met no depth, {} another depth, {} failed the reprojection, {} the normals, {} agreed",
      c.with_depth, c.masked, c.without_normal, c.too_few_views, min_views, c.contradicted, c.asked.outside,
      c.asked.no_depth, c.asked.depth, c.asked.reprojection, c.asked.normal, c.asked.agreed);
}

// What to do when nothing became a point: against what removed most.
std::string Advise(const FusionCounts& c, int min_views) {
  const ConsistencyCounts& asked = c.asked;
  if (c.with_depth == 0)
    return "No map holds any depth: run polarscan stereo again, with --no-filter to keep every pixel";
  if (2 * c.masked > c.with_depth)
    return "Most lies outside of the masks: check them, or leave them aside with --no-masks";
  if (2 * c.without_normal > c.with_depth) return "Most has no normal: run polarscan stereo again";
  if (2 * c.contradicted > c.with_depth)
    return "Other views see through most of the points: check the poses, or keep them with "
           "--fusion-contradictions 0";
  if (asked.agreed > c.too_few_views)
    return fmt::format("Views agree, but not {} of them: lower --fusion-min-views", min_views);
  if (asked.outside + asked.no_depth > asked.depth + asked.reprojection + asked.normal)
    return "The views hardly show the same surface: check the poses (polarscan report), take pictures closer "
           "together, or lower --fusion-min-views";
  // Depth is asked first, then reprojection, then normals; hidden places fail the first in good scans, too.
  if (asked.normal + asked.agreed > c.too_few_views) return "Normals differ: raise --fusion-normal";
  return asked.reprojection + asked.normal + asked.agreed > c.too_few_views
             ? "Points are seen beside each other: check the poses (polarscan report), or raise "
               "--fusion-reprojection"
             : "Depths differ: check the poses (polarscan report), or raise --fusion-depth";
}

// One run: the state that lasts from view to view.
class Fusion {
 public:
  Fusion(const Workspace& workspace, const MapKind& maps, const FusionOptions& options, Progress& progress)
      : workspace_(workspace),
        options_(options),
        progress_(progress),
        kind_(maps),
        cache_(CachedViewMaps(workspace, kind_, options.masks, std::size_t(options.memory_gb * 1e9))),
        usable_(UsableViews(workspace, kind_, progress)),
        places_(Places(workspace.views)),
        absorbed_(workspace.views.size()) {
    if (Usable() == 0)
      throw Error(fmt::format("no view has {} maps", ToString(kind_)), (workspace.folder / "stereo").string(),
                  "Run polarscan stereo first");
    if (MinViews() < options.min_views)
      progress.Warn(
          fmt::format("only {} views have depth maps; a point needs the agreement of {} instead of {}",
                      UsablePlaces(), MinViews(), options.min_views));
  }

  void Run(const PointSink& cloud) {
    progress_.Begin("fusion", std::size_t(Usable()));
    for (const int view : WalkingOrder(workspace_)) {
      if (!usable_[std::size_t(view)]) continue;
      progress_.Check();
      if (const auto reference = Load({view})[0]) FuseOne(view, *reference, cloud);
      progress_.Advance();
    }
    summary_.views = Usable();
    summary_.maps = ToString(kind_);
    summary_.neighbour_deg = NeighbourAngle(workspace_.views);
    summary_.counts.points = summary_.points;
    if (summary_.points == 0) ThrowNothing();
    const double n = double(summary_.points);
    summary_.mean_views /= n, summary_.mean_confidence /= n, summary_.mean_dop /= n;
  }

  const CloudSummary& summary() const { return summary_; }

 private:
  int Usable() const { return int(std::ranges::count(usable_, true)); }
  int MinViews() const { return std::min(options_.min_views, UsablePlaces()); }
  int UsablePlaces() const {
    std::set<int> places;
    for (std::size_t i = 0; i < usable_.size(); ++i)
      if (usable_[i]) places.insert(places_[i]);
    return int(places.size());
  }

  // The views' maps. Those that are damaged are left out from here on, and null here.
  std::vector<std::shared_ptr<const ViewMaps>> Load(const std::vector<int>& views) {
    std::vector<std::shared_ptr<const ViewMaps>> maps;
    const auto bytes = [&](int view) {
      const Pinhole& camera = workspace_.views[std::size_t(view)].camera;
      return std::size_t(camera.width) * std::size_t(camera.height) * ViewMaps::kBytesPerPixel;
    };
    const auto entries = cache_.GetAll(views, bytes);
    for (std::size_t i = 0; i < views.size(); ++i) {
      const bool sound = entries[i]->damage.empty();
      maps.emplace_back(sound ? std::shared_ptr<const ViewMaps>(entries[i], &entries[i]->maps) : nullptr);
      if (sound) {
        absorbed_.Prepare(views[i], maps.back()->depth);
        continue;
      }
      const std::string& name = workspace_.views[std::size_t(views[i])].name;
      usable_[std::size_t(views[i])] = false;
      summary_.damaged.push_back(name);
      progress_.Warn(fmt::format("view {} is damaged and left out: {}", name, entries[i]->damage));
    }
    return maps;
  }

  // Chosen anew when one of them turns out to be damaged, as if it had never been there.
  Candidates FindCandidates(int view, const ViewMaps& reference) {
    Candidates candidates;
    candidates.views = OverlappingViews(workspace_, view, reference, usable_, places_, options_.check_views);
    for (const int other : candidates.views)
      candidates.places.push_back(places_[std::size_t(other)] == places_[std::size_t(view)]
                                      ? kOwnPlace
                                      : places_[std::size_t(other)]);
    candidates.maps = Load(candidates.views);
    return std::ranges::count(candidates.maps, nullptr) ? FindCandidates(view, reference) : candidates;
  }

  void FuseOne(int view, const ViewMaps& reference, const PointSink& cloud) {
    FusionCounts& counts = summary_.counts;
    counts.inside += reference.pixels_inside;
    counts.outside += reference.pixels_outside;
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
      summary_.points += points.size();
      cloud(points);
    };
    FuseView(reference, view, candidates, MinViews(), options_, absorbed_, counts, sink, progress_);
  }

  [[noreturn]] void ThrowNothing() const {
    throw NothingFound("nothing to fuse: " + Explain(summary_.counts, MinViews()), workspace_.folder.string(),
                       Advise(summary_.counts, MinViews()));
  }

  const Workspace& workspace_;
  const FusionOptions& options_;
  Progress& progress_;
  const MapKind kind_;
  Cache<MapsOrDamage> cache_;
  std::vector<bool> usable_;
  const std::vector<int> places_;
  AbsorbedPixels absorbed_;
  CloudSummary summary_;
};

}  // namespace

CloudSummary FuseCloud(const std::filesystem::path& dense, const std::filesystem::path& cloud_ply,
                       const FusionOptions& options, Progress& progress) {
  return FuseCloud(ReadWorkspace(dense), cloud_ply, options, progress);
}

CloudSummary FuseCloud(const Workspace& workspace, const std::filesystem::path& cloud_ply,
                       const FusionOptions& options, Progress& progress) {
  Fusion fusion(workspace, MapKindOf(options.maps, workspace), options, progress);
  WriteAtomically(cloud_ply, [&](const std::filesystem::path& temporary) {
    CloudWriter cloud(
        temporary,
        "confidence = 1 - exp(-sum of sin(angle to the first view) (1 - residual) over the agreeing views)",
        workspace.offset);
    fusion.Run([&](const std::vector<CloudPoint>& points) { cloud.Add(points); });
    cloud.Finish();
  });
  WriteOffset(cloud_ply.parent_path(), workspace.offset);
  return fusion.summary();
}

std::vector<CloudPoint> FusePoints(const Workspace& workspace, const MapKind& maps,
                                   const FusionOptions& options, Progress& progress) {
  std::vector<CloudPoint> cloud;
  Fusion(workspace, maps, options, progress).Run([&](const std::vector<CloudPoint>& points) {
    cloud.insert(cloud.end(), points.begin(), points.end());
  });
  for (CloudPoint& p : cloud) p.normal = p.normal.cast<double>().normalized().cast<float>();
  return cloud;
}

}  // namespace polarscan
