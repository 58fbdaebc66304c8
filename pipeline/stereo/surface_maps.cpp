// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/surface_maps.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "core/cache.h"
#include "core/error.h"
#include "core/files.h"
#include "core/parallel.h"
#include "fusion/cloud/fuse.h"
#include "fusion/mesh_topology.h"
#include "fusion/surface/poisson/poisson.h"
#include "pipeline/meshing.h"
#include "pipeline/stereo/done_list.h"
#include "pipeline/stereo/stage_inputs.h"
#include "stereo/costs/view.h"
#include "stereo/dense/crop.h"
#include "stereo/dense/load_view.h"
#include "stereo/map_io.h"
#include "stereo/rounds/vote.h"
#include "stereo/search/filter.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostPoints = 2'000'000;  // that make the surface: every second, third, ... of more
constexpr std::size_t kLeastCloud = 100;
constexpr double kCell = 2.2;  // px, of the octree that makes the surface: coarser ones lose detail
constexpr int kFinestDepth = 12;
constexpr std::size_t kMostCells = 1'000'000;  // of the octree: coarser steps are taken for more ...
constexpr int kMostCoarser = 3;                // ... but no more than these
constexpr float kSame = 0.02f;         // share of the depth by which an estimate may differ from a membrane
constexpr double kSupportOfTwo = 1.2;  // a view gives 1 at most: more than one alone, though both look askew
constexpr float kLeastFacing = 0.02f;  // cosine between a normal and the line of sight

// The maps of a turn; the last one's are the result, but for the filter.
std::string TurnMaps(int turn) { return fmt::format("step-surface{}", turn); }

struct Drawn {
  RayCaster caster;
  std::vector<bool> far;
};

std::vector<CloudPoint> FusedCloud(const Workspace& workspace, const std::string& kind,
                                   const StereoOptions& options, Progress& progress) {
  const fs::path folder = workspace.folder / "stereo/surface", file = folder / "cloud.ply";
  fs::remove_all(folder);  // what a killed run left
  CreateFolder(folder);
  FusionOptions fusion;
  fusion.maps = kind;
  fusion.masks = options.masks;
  FuseCloud(workspace, file, fusion, progress);
  std::vector<CloudPoint> cloud = ReadCloud(file);
  fs::remove_all(folder);
  const std::size_t every = 1 + (cloud.size() - 1) / kMostPoints;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < cloud.size(); i += every) cloud[kept++] = cloud[i];
  cloud.resize(kept);
  return cloud;
}

RefineOptions RefinementBy(const StereoOptions& options) {
  RefineOptions refinement;
  refinement.polarization = options.polarization;
  refinement.masks = options.masks;
  refinement.aop_noise_deg = options.aop_noise_deg;
  return refinement;
}

// Without polarization where it is nothing but noise, without surfaces where nothing could refine one, and
// asking two places for no more support than they can give.
StereoOptions WithWhatHelps(const Workspace& workspace, StereoOptions options) {
  if (options.polarization && options.polarization_evidence == "noise" && workspace.polarized)
    options.polarization = AopIsInformative(workspace, options.masks, options.aop_noise_deg);
  if (options.schedule != "checkerboard" || !CanRefine(workspace, RefinementBy(options)))
    options.surfaces = 0;
  const std::vector<int> places = Places(workspace.views);
  if (std::set<int>(places.begin(), places.end()).size() == 2)
    options.filter_min_support = std::min(options.filter_min_support, kSupportOfTwo);
  return options;
}

// Throws NothingFound if the maps make no surface as fine as they are.
Drawn CommonSurface(const Workspace& workspace, const std::string& kind, const StereoOptions& options,
                    Progress& progress) {
  const std::vector<CloudPoint> cloud = FusedCloud(workspace, kind, options, progress);
  if (cloud.size() < kLeastCloud)
    throw NothingFound(fmt::format("{} points that views agree on are too few for a surface", cloud.size()),
                       workspace.folder);
  MeshOptions meshing;
  const double pixel = PixelSize(cloud, workspace);
  for (meshing.depth = kCoarsestDepth; PoissonCell(cloud, meshing.depth) > kCell * pixel;) ++meshing.depth;
  const int finest = meshing.depth;
  meshing.depth = std::min(finest, kFinestDepth);
  while (meshing.depth > std::max(kCoarsestDepth, finest - kMostCoarser) &&
         OccupiedCells(cloud, meshing.depth) > kMostCells)
    --meshing.depth;
  if (meshing.depth < finest - kMostCoarser || OccupiedCells(cloud, meshing.depth) > kMostCells)
    throw NothingFound("the scene is too large for one surface as fine as its pictures", workspace.folder);
  meshing.refinement = RefinementBy(options);
  meshing.silhouette_margin_px = options.silhouette_margin_px;
  MeshSummary summary;
  CloudSurface surface = MakeSurface(cloud, workspace, meshing, summary, progress);
  return {RayCaster({std::move(surface.mesh)}), std::move(surface.far)};
}

// Turned so far that it faces the camera.
Eigen::Vector3f Facing(const Eigen::Vector3f& normal, const Eigen::Vector3f& ray) {
  const Eigen::Vector3f sight = ray.normalized();
  const float away = normal.dot(sight) + kLeastFacing;
  return away <= 0 ? normal : (normal - away * sight).normalized();
}

// The view's map with the surface in it.
DepthNormalMap Drawing(const Drawn& surface, const DenseView& view, bool masked, const DepthNormalMap& own) {
  DepthNormalMap map = own;
  const Eigen::Matrix3d& rotation = view.cam_from_world.rotation;
  const Eigen::Vector3d centre = view.cam_from_world.Center();
  ParallelFor(0, own.depth.height(), [&](int y) {
    for (int x = 0; x < own.depth.width(); ++x) {
      if (own.depth(x, y) <= 0) continue;
      const Eigen::Vector3d ray = view.camera.Ray(x + 0.5, y + 0.5);
      const RayCaster::Hit hit = surface.caster.Cast(centre, rotation.transpose() * ray);
      if (hit.mesh < 0) continue;
      const auto depth = float(hit.distance);  // the ray's z is 1
      const Triangle& triangle = surface.caster.meshes()[0].triangles[std::size_t(hit.triangle)];
      const bool borne_out =
          !surface.far[triangle[0]] && !surface.far[triangle[1]] && !surface.far[triangle[2]];
      if (!masked && !borne_out && std::abs(depth / own.depth(x, y) - 1) > kSame) continue;
      map.depth(x, y) = depth;
      map.normal(x, y) = Facing((rotation * surface.caster.Normal(hit)).cast<float>(), ray.cast<float>());
    }
  });
  return map;
}

class SurfaceStep {
 public:
  SurfaceStep(const Workspace& workspace, const StereoOptions& options, DoneList& done, Progress& progress)
      : workspace_(workspace),
        options_(options),
        done_(done),
        progress_(progress),
        scale_(options.filter ? GrayScale(workspace) : 1),
        views_(
            CacheBytes(), [this](int v) { return LoadStereoView(workspace_, v, scale_, options_); },
            [](const StereoView& v) { return BytesOf(v); }),
        maps_(
            CacheBytes(), [this](int v) { return ReadMaps(workspace_, v, kSeparateMaps); },
            [](const DepthNormalMap& m) { return BytesOf(m); }) {}

  void Run() {
    std::string maps = kSeparateMaps;
    for (int turn = 1; turn <= options_.surfaces; ++turn) {
      const std::string before = std::exchange(maps, TurnMaps(turn));
      Draw(before, maps);
      if (turn > 1 && turn < options_.surfaces && MeanChange(before, maps) < options_.surface_change_px)
        break;
    }
    if (options_.filter)
      Filter(maps);  // after the drawing: the surface is gone from memory
    else
      ForEachView("final maps", maps, kFinalMaps, [](int, DepthNormalMap&) {});
  }

 private:
  std::size_t CacheBytes() const { return std::size_t(options_.cache_gb * 1e9) / 2; }

  // Makes the maps of one kind of another's.
  void Draw(const std::string& before, const std::string& after) {
    if (done_.IsDone(after)) return;
    const std::optional<Drawn> surface = Surface(before);
    malloc_trim(0);  // the making of it took several times as much
    ForEachView("maps from the surface", before, after, [&](int view, DepthNormalMap& map) {
      if (surface) map = Drawing(*surface, workspace_.views[std::size_t(view)], IsMasked(view), map);
    });
  }

  // Of the depths that both kinds of maps hold, in sizes of a pixel there.
  double MeanChange(const std::string& before, const std::string& after) const {
    const std::size_t count = workspace_.views.size();
    std::vector<double> sums(count), pixels(count);
    ParallelFor(0, int(count), [&](int view) {
      const Image<float> old_depth = ReadDepthMap(workspace_.DepthPath(view, before)),
                         new_depth = ReadDepthMap(workspace_.DepthPath(view, after));
      const double focal = workspace_.views[std::size_t(view)].camera.fx;
      for (std::size_t i = 0; i < new_depth.size(); ++i) {
        const double a = old_depth.pixels()[i], b = new_depth.pixels()[i];
        if (a <= 0 || b <= 0) continue;
        sums[std::size_t(view)] += focal * std::abs(b / a - 1), ++pixels[std::size_t(view)];
      }
    });
    const double all = std::accumulate(pixels.begin(), pixels.end(), 0.0);
    return all > 0 ? std::accumulate(sums.begin(), sums.end(), 0.0) / all : 0;
  }

  // By the support that the other views' separate maps give these depths.
  void Filter(const std::string& before) {
    ForEachView("filter", before, kFinalMaps, [&](int view, DepthNormalMap& map) {
      const auto reference = views_.Get(view);
      const Problem problem = VotersProblem(workspace_, view, options_, *reference, views_, maps_);
      const Image<float> support =
          SupportOf(map.depth, problem, *maps_.Get(view), 2 * float(options_.vote_sigma));
      FilterBySupport(problem, options_, support, map);
    });
  }

  template <class Change>
  void ForEachView(const char* title, const std::string& before, const std::string& after, Change&& change) {
    progress_.Begin(title, workspace_.views.size());
    for (int view = 0; view < int(workspace_.views.size()); ++view) {
      progress_.Check();
      if (!done_.IsDone(view, after)) {
        DepthNormalMap map = ReadMaps(workspace_, view, before);
        change(view, map);
        WriteMaps(workspace_, view, after, map);
        done_.Add(view, after);
      }
      progress_.Advance();
    }
  }

  bool IsMasked(int view) const { return options_.masks && fs::exists(workspace_.MaskPath(view)); }

  std::optional<Drawn> Surface(const std::string& kind) {
    if (there_is_none_) return {};
    try {
      return CommonSurface(workspace_, kind, options_, progress_);
    } catch (const NothingFound& error) {
      there_is_none_ = true;
      progress_.Warn(fmt::format("the views' maps stay separate, which is less accurate: {}", error.what()));
      return {};
    }
  }

  const Workspace& workspace_;
  const StereoOptions& options_;
  DoneList& done_;
  Progress& progress_;
  const float scale_;
  bool there_is_none_ = false;
  Cache<StereoView> views_;
  Cache<DepthNormalMap> maps_;
};

// Of views that are not chosen now: maps of an earlier run with other options.
void RemoveOtherMaps(const Workspace& all, const Workspace& chosen) {
  for (int view = 0; view < int(all.views.size()); ++view) {
    const std::string& name = all.views[std::size_t(view)].name;
    if (std::ranges::binary_search(chosen.views, name, {}, &DenseView::name)) continue;
    fs::remove(all.DepthPath(view, kFinalMaps));
    fs::remove(all.NormalPath(view, kFinalMaps));
  }
}

// All steps, the surfaces among them.
void EstimateWithSurfaces(const Workspace& workspace, const StereoOptions& options, std::uint64_t inputs,
                          Progress& progress, const Shard& shard) {
  const DoneList before(workspace, inputs, shard);
  if (!before.IsDone(kFinalMaps)) {
    // Not again for one that goes on with the surfaces: it would forget those that there are.
    if (shard.count > 1 || !before.IsDone(kSeparateMaps))
      EstimateDepths(workspace, options, inputs, progress, shard);
    if (shard.count > 1) return;
    DoneList done(workspace, inputs);
    SurfaceStep(workspace, options, done, progress).Run();
  }
  if (shard.count > 1) return;
  DoneList done(workspace, inputs);
  for (int turn = 1; turn <= options.surfaces; ++turn) done.Remove(TurnMaps(turn));
  done.Remove(kSeparateMaps);
  done.KeepOnly(kFinalMaps);
}

}  // namespace

StereoPlan PlanMaps(const fs::path& dense, const StereoOptions& options) {
  return PlanDepths(dense, WithWhatHelps(ChosenViews(ReadWorkspace(dense), options.views), options));
}

void EstimateMaps(const fs::path& dense, const StereoOptions& asked, Progress& progress, const Shard& shard) {
  const Workspace all = ReadWorkspace(dense), workspace = ChosenViews(all, asked.views);
  const StereoOptions options = WithWhatHelps(workspace, asked);
  if (asked.polarization && !options.polarization)
    progress.Warn("the pictures' polarization is nothing but noise: it is left out, as by --no-polarization");
  const std::uint64_t inputs = StereoInputHash(workspace, options);  // reads all pictures: once
  const Workspace cut = CutToObject(workspace, options);
  if (options.surfaces > 0)
    EstimateWithSurfaces(cut, options, inputs, progress, shard);
  else
    EstimateDepths(cut, options, inputs, progress, shard);
  if (shard.count == 1) RemoveOtherMaps(all, workspace);  // last: nothing is lost if this run fails
}

}  // namespace polarscan
