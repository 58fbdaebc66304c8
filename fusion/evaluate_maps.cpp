// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "fusion/error_statistics.h"
#include "fusion/evaluate.h"
#include "fusion/maps.h"
#include "fusion/thresholds.h"
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
};

ViewErrors Compare(const Image<float>& depth, const Image<Eigen::Vector3f>& normal, double scale,
                   const TrueMaps& truth) {
  ViewErrors errors;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const double estimate = depth.pixels()[i], expected = truth.depth.pixels()[i];
    const bool object = expected > 0, estimated = std::isfinite(estimate) && estimate > 0;
    errors.object += object;
    errors.estimated += estimated;
    if (!object || !estimated) continue;
    ++errors.both;
    errors.depth.push_back(std::abs(scale * estimate - expected));
    if (normal.empty()) continue;
    const Eigen::Vector3d n = normal.pixels()[i].cast<double>();
    const double length = n.norm();
    if (std::isfinite(length) && length > 1e-6)
      errors.normal_deg.push_back(AngleDegrees(n, truth.normal.pixels()[i]));
  }
  return errors;
}

struct Scales {
  double unit;
  std::vector<double> depth, normal_deg;
};

nlohmann::json Report(const ViewErrors& errors, bool with_normals, const EvaluateOptions& options,
                      const Scales& scales) {
  const auto share = [](std::size_t part, std::size_t all) {
    return all == 0 ? 0 : double(part) / double(all);
  };
  nlohmann::json report = {
      {"object_pixels", errors.object},
      {"completeness", share(errors.both, errors.object)},
      {"beyond", share(errors.estimated - errors.both, errors.estimated)},
      {"depth", PixelErrors(errors.depth, errors.object, options.depth_penalty * scales.unit, scales.depth)}};
  if (with_normals)
    report["normal_degrees"] =
        PixelErrors(errors.normal_deg, errors.object, options.normal_penalty_deg, scales.normal_deg);
  return report;
}

nlohmann::json EvaluateView(const Workspace& workspace, int view, const std::string& kind,
                            const Similarity& truth_from_scan, const Truth& truth,
                            const EvaluateOptions& options, const Scales& scales, Progress& progress) {
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
  return Report(Compare(depth, normal, truth_from_scan.scale, expected), with_normals, options, scales);
}

}  // namespace

nlohmann::json EvaluateMaps(const Workspace& workspace, const Similarity& truth_from_scan, const Truth& truth,
                            const EvaluateOptions& options, Progress& progress) {
  const std::string kind = options.kind == "auto" ? BestMapKind(workspace) : options.kind;
  const double unit = options.unit > 0 ? options.unit : ObjectUnit(truth.object());
  const Scales scales{unit, ParseThresholds(options.depth_thresholds, unit),
                      ParseThresholds(options.normal_thresholds_deg, 1)};
  nlohmann::json per_view = nlohmann::json::object();
  std::vector<nlohmann::json> reports;
  progress.Begin("comparing maps", workspace.views.size());
  for (int i = 0; i < int(workspace.views.size()); ++i) {
    progress.Check();
    if (HasMaps(workspace, i, kind)) {
      reports.push_back(EvaluateView(workspace, i, kind, truth_from_scan, truth, options, scales, progress));
      per_view[workspace.views[std::size_t(i)].name] = reports.back();
    }
    progress.Advance();
  }
  if (reports.empty())
    throw Error(fmt::format("there are no {} maps", kind), (workspace.folder / "stereo").string(),
                "Run polarscan stereo first");
  if (std::ranges::all_of(reports, [](const auto& report) { return report.at("object_pixels") == 0; }))
    progress.Warn("the cameras see nothing of the true object: cameras and truth may be in different frames");
  return {{"kind", kind},
          {"views", reports.size()},
          {"views_without_maps", workspace.views.size() - reports.size()},
          {"unit", unit},
          {"depth_penalty", options.depth_penalty * unit},
          {"normal_penalty", options.normal_penalty_deg},
          {"mean", MeanOf(reports)},
          {"per_view", per_view}};
}

}  // namespace polarscan
