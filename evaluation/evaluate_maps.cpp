// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "evaluation/error_statistics.h"
#include "evaluation/evaluate.h"
#include "evaluation/thresholds.h"
#include "fusion/cloud/maps.h"
#include "stereo/map_io.h"

namespace polarscan {
namespace {

struct TrueMaps {
  Image<double> depth;            // z, units of the truth; 0: the ray does not meet the object first
  Image<Eigen::Vector3d> normal;  // unit, camera frame, towards the camera
};

// The first hit of the ray through each pixel's centre; vertex normals interpolated.
TrueMaps Cast(const Truth& truth, const Pinhole& camera, const Rigid& cam_from_truth, Progress& progress) {
  TrueMaps maps{{camera.width, camera.height}, {camera.width, camera.height, Eigen::Vector3d::Zero()}};
  const Eigen::Vector3d centre = cam_from_truth.Center();
  ParallelFor(0, camera.height, [&](int y) {
    progress.Check();
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d ray = camera.Ray(x + 0.5, y + 0.5);
      const RayCaster::Hit hit = truth.caster.Cast(centre, cam_from_truth.rotation.transpose() * ray);
      if (hit.mesh != 0) continue;
      const Eigen::Vector3d normal = cam_from_truth.rotation * truth.caster.Normal(hit);
      maps.depth(x, y) = hit.distance;
      maps.normal(x, y) = normal.dot(ray) > 0 ? Eigen::Vector3d(-normal) : normal;
    }
  });
  return maps;
}

// Pixels outside of the mask are none of the object's.
void ApplyMask(const Image<std::uint8_t>& mask, TrueMaps& maps) {
  if (mask.empty()) return;
  const int width = maps.depth.width(), height = maps.depth.height();
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (mask(x * mask.width() / width, y * mask.height() / height) == 0) maps.depth(x, y) = 0;
}

struct ViewErrors {
  std::size_t object = 0, estimated = 0, both = 0;
  std::vector<double> depth, normal_deg;  // over the object's estimated pixels; normals where there is one
  ErrorMaps maps;
};

ViewErrors Compare(const Image<float>& depth, const Image<Eigen::Vector3f>& normal, double scale,
                   const TrueMaps& truth) {
  constexpr float kNotObject = std::numeric_limits<float>::quiet_NaN(),
                  kMissing = std::numeric_limits<float>::infinity();
  const int width = depth.width(), height = depth.height();
  ViewErrors errors;
  errors.maps.depth = Image<float>(width, height, kNotObject);
  if (!normal.empty()) errors.maps.normal_deg = Image<float>(width, height, kNotObject);
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const double estimate = depth.pixels()[i], expected = truth.depth.pixels()[i];
    const bool object = expected > 0, estimated = std::isfinite(estimate) && estimate > 0;
    errors.object += object;
    errors.estimated += estimated;
    if (!object) continue;
    errors.maps.depth.pixels()[i] = kMissing;
    if (!normal.empty()) errors.maps.normal_deg.pixels()[i] = kMissing;
    if (!estimated) continue;
    ++errors.both;
    errors.depth.push_back(std::abs(scale * estimate - expected));
    errors.maps.depth.pixels()[i] = float(errors.depth.back());
    if (normal.empty()) continue;
    const Eigen::Vector3d n = normal.pixels()[i].cast<double>();
    const double length = n.norm();
    if (!std::isfinite(length) || length < 1e-6) continue;
    errors.normal_deg.push_back(AngleDegrees(n, truth.normal.pixels()[i]));
    errors.maps.normal_deg.pixels()[i] = float(errors.normal_deg.back());
  }
  return errors;
}

struct Scales {
  double unit;
  std::vector<double> depth, normal_deg;
};

MapErrors SumUp(const ViewErrors& errors, const EvaluateOptions& options, const Scales& scales) {
  const auto share = [](std::size_t part, std::size_t all) {
    return all == 0 ? 0 : double(part) / double(all);
  };
  const double depth_penalty = options.depth_penalty * scales.unit;
  MapErrors figures{double(errors.object), share(errors.both, errors.object),
                    share(errors.estimated - errors.both, errors.estimated),
                    SumUpPixels(errors.depth, errors.object, depth_penalty, scales.depth), std::nullopt};
  if (!errors.maps.normal_deg.empty())
    figures.normal_deg =
        SumUpPixels(errors.normal_deg, errors.object, options.normal_penalty_deg, scales.normal_deg);
  return figures;
}

ViewErrors CompareView(const Workspace& workspace, int view, const MapKind& kind,
                       const Similarity& truth_from_scan, const Truth& truth, const EvaluateOptions& options,
                       Progress& progress) {
  const DenseView& dense = workspace.views[std::size_t(view)];
  const Image<float> depth = ReadDepthMap(workspace.DepthPath(view, kind));
  const std::filesystem::path normal_path = workspace.NormalPath(view, kind);
  const bool with_normals = std::filesystem::exists(normal_path);
  const auto normal = with_normals ? ReadNormalMap(normal_path) : Image<Eigen::Vector3f>();
  if (with_normals && !SameSize(depth, normal))
    throw Error("depth and normal map differ in size", normal_path.string());
  TrueMaps expected = Cast(truth, dense.camera.Resized(depth.width(), depth.height()),
                           truth_from_scan(dense.cam_from_world), progress);
  if (options.masks) ApplyMask(ReadViewMask(workspace, view), expected);
  return Compare(depth, normal, truth_from_scan.scale, expected);
}

// All object pixels of all views.
struct Curves {
  ErrorCurve depth, normal_deg;
  void Add(const ViewErrors& errors) {
    depth.Add(errors.depth);
    depth.AddMissing(errors.object - errors.depth.size());
    if (errors.maps.normal_deg.empty()) return;
    normal_deg.Add(errors.normal_deg);
    normal_deg.AddMissing(errors.object - errors.normal_deg.size());
  }
};

}  // namespace

MapsEvaluation EvaluateMaps(const Workspace& workspace, const Similarity& truth_from_scan, const Truth& truth,
                            const EvaluateOptions& options, Progress& progress, const ErrorMapSink& sink) {
  const MapKind kind = MapKindOf(options.kind, workspace);
  const double unit = options.unit > 0 ? options.unit : ObjectUnit(truth.object());
  const Scales scales{unit, ParseThresholds(options.depth_thresholds, unit),
                      ParseThresholds(options.normal_thresholds_deg, 1)};
  std::map<std::string, MapErrors> per_view;
  std::vector<MapErrors> views;  // in their order
  Curves curves{ErrorCurve(std::ranges::max(scales.depth)), ErrorCurve(std::ranges::max(scales.normal_deg))};
  progress.Begin("comparing maps", workspace.views.size());
  for (int i = 0; i < int(workspace.views.size()); ++i) {
    progress.Check();
    if (HasMaps(workspace, i, kind)) {
      const std::string& name = workspace.views[std::size_t(i)].name;
      const ViewErrors errors = CompareView(workspace, i, kind, truth_from_scan, truth, options, progress);
      views.push_back(SumUp(errors, options, scales));
      per_view[name] = views.back();
      curves.Add(errors);
      if (sink) sink(name, errors.maps);
    }
    progress.Advance();
  }
  if (views.empty())
    throw Error(fmt::format("there are no {} maps", ToString(kind)), (workspace.folder / "stereo").string(),
                "Run polarscan stereo first");
  if (std::ranges::all_of(views, [](const MapErrors& view) { return view.object_pixels == 0; }))
    progress.Warn("the cameras see nothing of the true object: cameras and truth may be in different frames");
  return {.kind = ToString(kind),
          .views = views.size(),
          .views_without_maps = workspace.views.size() - views.size(),
          .unit = unit,
          .depth_penalty = options.depth_penalty * unit,
          .normal_penalty_deg = options.normal_penalty_deg,
          .mean = MeanOf(views),
          .depth = curves.depth.Shares(),
          .normal_deg = curves.normal_deg.Shares(),
          .per_view = std::move(per_view)};
}

}  // namespace polarscan
