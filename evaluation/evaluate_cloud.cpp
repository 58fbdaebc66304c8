// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "evaluation/error_statistics.h"
#include "evaluation/evaluate.h"
#include "evaluation/thresholds.h"
#include "fusion/surface/nearest_points.h"
#include "fusion/surface/surface.h"

namespace polarscan {
namespace {

std::vector<double> Distances(const std::vector<Eigen::Vector3d>& points,
                              const std::vector<TriangleMesh>& meshes, Progress& progress) {
  const RayCaster surface(meshes);
  std::vector<double> distances(points.size());
  ParallelFor(0, int(points.size()), [&](int i) {
    if (i % 1024 == 0) progress.Check();
    distances[std::size_t(i)] = surface.Distance(points[std::size_t(i)]);
  });
  return distances;
}

// The points that count as the object's, and how many do not.
struct ObjectPoints {
  std::vector<Eigen::Vector3d> points;
  std::vector<double> distances;  // to the object
  std::size_t of_surroundings = 0, cropped = 0;
};

ObjectPoints SelectObjectPoints(const std::vector<Eigen::Vector3d>& points, const Truth& truth, double crop,
                                Progress& progress, const PointErrorSink& sink) {
  const auto& meshes = truth.caster.meshes();
  const std::vector<double> to_object = Distances(points, {meshes[0]}, progress);
  if (sink) sink(to_object);
  std::vector<double> to_rest;
  if (meshes.size() > 1) to_rest = Distances(points, {meshes.begin() + 1, meshes.end()}, progress);
  ObjectPoints object;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!to_rest.empty() && to_rest[i] < to_object[i]) {
      ++object.of_surroundings;
    } else if (crop > 0 && to_object[i] > crop) {
      ++object.cropped;
    } else {
      object.points.push_back(points[i]);
      object.distances.push_back(to_object[i]);
    }
  }
  return object;
}

bool Sees(const DenseView& view, const SurfaceSample& sample, const Truth& truth, double lift) {
  const Eigen::Vector3d to_camera = view.cam_from_world.Center() - sample.position;
  return view.camera.Sees(view.cam_from_world * sample.position) && to_camera.dot(sample.normal) > 0 &&
         !truth.caster.Occluded(sample.position + lift * sample.normal, to_camera, 1);
}

// Positions of the samples that at least `least` views see.
std::vector<Eigen::Vector3d> VisibleSamples(const std::vector<SurfaceSample>& samples,
                                            const std::vector<DenseView>& views, int least,
                                            const Truth& truth, Progress& progress) {
  const double lift = 1e-4 * BoundingRadius(truth.object());
  std::vector<char> visible(samples.size(), least <= 0 || views.empty());
  ParallelFor(0, int(samples.size()), [&](int i) {
    if (i % 1024 == 0) progress.Check();
    int seen = 0;
    for (std::size_t v = 0; v < views.size() && !visible[std::size_t(i)]; ++v) {
      seen += Sees(views[v], samples[std::size_t(i)], truth, lift);
      visible[std::size_t(i)] = seen >= least;
    }
  });
  std::vector<Eigen::Vector3d> positions;
  for (std::size_t i = 0; i < samples.size(); ++i)
    if (visible[i]) positions.push_back(samples[i].position);
  return positions;
}

std::map<double, CloudShares> AtThresholds(const std::vector<double>& accuracy,
                                           const std::vector<double>& completeness,
                                           const std::vector<double>& thresholds) {
  std::map<double, CloudShares> shares;
  for (double t : thresholds) {
    const double p = ShareBelow(accuracy, t), r = ShareBelow(completeness, t);
    shares[t] = {p, r, p + r > 0 ? 2 * p * r / (p + r) : 0};
  }
  return shares;
}

std::optional<Curve> CurveOf(const std::vector<double>& distances, const std::vector<double>& thresholds) {
  ErrorCurve curve(std::ranges::max(thresholds));
  curve.Add(distances);
  return curve.Shares();
}

}  // namespace

CloudEvaluation EvaluateCloud(const std::vector<Eigen::Vector3d>& points,
                              const std::vector<DenseView>& cameras, const Truth& truth,
                              const EvaluateOptions& options, std::uint64_t seed, Progress& progress,
                              const PointErrorSink& sink) {
  const double unit = options.unit > 0 ? options.unit : ObjectUnit(truth.object());
  const std::vector<double> thresholds = ParseThresholds(options.cloud_thresholds, unit);
  progress.Begin("comparing the cloud", 3, "step");
  const ObjectPoints object = SelectObjectPoints(points, truth, options.crop * unit, progress, sink);
  progress.Advance();
  if (object.points.empty())
    throw Error(fmt::format("none of the cloud's points counts as the object's ({} points, {} nearer to the "
                            "surroundings, {} beyond --crop)",
                            points.size(), object.of_surroundings, object.cropped),
                "evaluation", "Are cloud and truth in the same frame?");
  const auto samples = SampleSurface(truth.object(), options.samples, seed);
  const auto counted = VisibleSamples(samples, cameras, options.seen_by, truth, progress);
  progress.Advance();
  if (counted.empty())
    progress.Warn("the cameras see nothing of the true object: cameras and truth may be in different frames");
  const std::vector<double> completeness = NearestDistances(object.points, counted);
  progress.Advance();
  const double area = SurfaceArea(truth.object());
  return {.points = points.size(),
          .points_of_surroundings = object.of_surroundings,
          .points_cropped = object.cropped,
          .samples = samples.size(),
          .visible_share = double(counted.size()) / double(samples.size()),
          .area = area,
          .sample_spacing = std::sqrt(area / double(samples.size())),
          .unit = unit,
          .cap = options.cap * unit,
          .accuracy = SumUpDistances(object.distances, options.cap * unit),
          .completeness = SumUpDistances(completeness, options.cap * unit),
          .within = AtThresholds(object.distances, completeness, thresholds),
          .accuracy_curve = CurveOf(object.distances, thresholds),
          .completeness_curve = CurveOf(completeness, thresholds)};
}

}  // namespace polarscan
