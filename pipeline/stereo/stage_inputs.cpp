// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/stage_inputs.h"

#include <algorithm>
#include <filesystem>

#include "core/error.h"
#include "stereo/dense/load_view.h"
#include "stereo/map_io.h"

namespace polarscan {
namespace {

// The picture's image with this one in its window, and nothing around it.
template <class T>
Image<T> InPicture(const PictureWindow& window, const Image<T>& part, T nothing) {
  Image<T> picture(window.picture_width, window.picture_height, nothing);
  for (int y = 0; y < part.height(); ++y)
    std::copy_n(part.row(y), part.width(), picture.row(window.top + y) + window.left);
  return picture;
}

std::size_t BytesOf(const StereoView& view) {
  return view.gray.size() * (sizeof(float) + sizeof(std::uint32_t) + 2) +
         view.evidence.size() * sizeof(float) + view.polar.size() * sizeof(PolarSample);
}

std::size_t BytesOf(const DepthNormalMap& map) {
  return map.depth.size() * (sizeof(float) + sizeof(Eigen::Vector3f));
}

std::size_t CacheBytes(const StereoOptions& options) { return std::size_t(options.cache_gb * 1e9) / 2; }

}  // namespace

Cache<StereoView> CachedViews(const Workspace& workspace, const StereoOptions& options, float scale,
                              int halvings) {
  const auto load = [&workspace, &options, scale, halvings](int view) {
    return LoadStereoView(workspace, view, scale, options, halvings);
  };
  return {CacheBytes(options), load, [](const StereoView& view) { return BytesOf(view); }};
}

Cache<DepthNormalMap> CachedMaps(const StereoOptions& options, std::function<DepthNormalMap(int)> read) {
  return {CacheBytes(options), std::move(read), [](const DepthNormalMap& map) { return BytesOf(map); }};
}

DepthNormalMap ReadMaps(const Workspace& workspace, int view, const MapKind& kind) {
  DepthNormalMap map{ReadDepthMap(workspace.DepthPath(view, kind)),
                     ReadNormalMap(workspace.NormalPath(view, kind))};
  if (kind != kFinalMaps) return map;
  const DenseView& dense = workspace.views[std::size_t(view)];
  return {InWindow(dense, std::move(map.depth)), InWindow(dense, std::move(map.normal))};
}

void WriteMaps(const Workspace& workspace, int view, const MapKind& kind, const DepthNormalMap& map) {
  const std::optional<PictureWindow>& window = workspace.views[std::size_t(view)].window;
  const bool whole = kind == kFinalMaps && window;
  WriteDepthMap(workspace.DepthPath(view, kind), whole ? InPicture(*window, map.depth, 0.0f) : map.depth);
  WriteNormalMap(
      workspace.NormalPath(view, kind),
      whole ? InPicture<Eigen::Vector3f>(*window, map.normal, Eigen::Vector3f::Zero()) : map.normal);
}

void RemovePassingMaps(const Workspace& workspace) {
  for (const char* folder : {"stereo/depth_maps", "stereo/normal_maps"}) {
    std::vector<std::filesystem::path> left;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(workspace.folder / folder))
      if (entry.path().stem().extension().string().starts_with(std::string(".") + kPassingMaps))
        left.push_back(entry.path());
    for (const std::filesystem::path& path : left) std::filesystem::remove(path);
  }
}

Problem MakeProblem(const Workspace& workspace, int view, const StereoOptions& options,
                    const StereoView& reference, Cache<StereoView>& views, Cache<DepthNormalMap>* maps) {
  const DenseView& dense = workspace.views[std::size_t(view)];
  if (dense.sources.empty())
    throw Error("no other view looks at the same place", dense.name,
                "Add pictures between this view and the others");
  Problem problem{&reference, {}, float(dense.depth_min), float(dense.depth_max), view};
  for (int source : dense.sources) {
    if (int(problem.sources.size()) >= options.sources) break;
    problem.sources.push_back(MakeSource(reference, views.Get(source), maps ? maps->Get(source) : nullptr));
  }
  return problem;
}

Problem VotersProblem(const Workspace& workspace, int view, const StereoOptions& options,
                      const StereoView& reference, Cache<StereoView>& views, Cache<DepthNormalMap>& maps) {
  const DenseView& own = workspace.views[std::size_t(view)];
  const double depth = 0.5 * (own.depth_min + own.depth_max);
  const Eigen::Vector3d middle =
      own.cam_from_world.Inverse() * (depth * own.camera.Ray(own.camera.width / 2., own.camera.height / 2.));
  const Eigen::Vector3d here = own.cam_from_world.Center() - middle;
  std::vector<std::pair<double, int>> voters;
  for (int other = 0; other < int(workspace.views.size()); ++other) {
    const DenseView& voter = workspace.views[std::size_t(other)];
    const double angle = AngleDegrees(here, voter.cam_from_world.Center() - middle);
    if (other != view && angle <= options.vote_angle_deg) voters.emplace_back(angle, other);
  }
  std::ranges::sort(voters);
  Problem problem{&reference, {}, float(own.depth_min), float(own.depth_max), view};
  std::vector<int> heard = {view};
  for (const auto& [angle, other] : voters) {
    const DenseView& voter = workspace.views[std::size_t(other)];
    if (heard.size() > std::size_t(options.vote_views)) break;
    if (std::ranges::any_of(heard, [&](int v) { return SamePlace(voter, workspace.views[std::size_t(v)]); }))
      continue;
    heard.push_back(other);
    problem.sources.push_back(MakeSource(reference, views.Get(other), maps.Get(other)));
  }
  return problem;
}

std::vector<Source> SourcesWithSilhouettes(const Workspace& workspace, int view, const StereoOptions& options,
                                           const StereoView& reference, Cache<StereoView>& views) {
  std::vector<Source> silhouettes;
  for (int other = 0; options.silhouettes && other < int(workspace.views.size()); ++other) {
    if (other == view) continue;
    const auto seen = views.Get(other);
    if (!seen->silhouette.empty()) silhouettes.push_back(MakeSource(reference, seen, nullptr));
  }
  return silhouettes;
}

}  // namespace polarscan
