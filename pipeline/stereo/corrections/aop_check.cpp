// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/corrections/aop_check.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "fusion/cloud/maps.h"
#include "pipeline/coarse_shape.h"
#include "stereo/costs/stereo_view.h"
#include "stereo/map_io.h"

namespace polarscan {
namespace {

constexpr int kMostPlaces = 4000;
constexpr int kNormals = 100;           // tried at a place
constexpr double kConeDeg = 36;         // half the cone's angle: wrong angles bend coarse normals by less
constexpr double kLeastWitness = 2;     // sum of the weights of the views at a place
constexpr float kSameDepth = 0.01f;     // share of the depth by which two views' depths may differ
constexpr double kGrazingCosine = 0.1;  // between a normal and a line of sight
constexpr int kEnoughPoints = 100;
constexpr double kClear = 0.01, kSure = 4;  // how much better, and in standard deviations
// One view has no say in the normals. Of sound sets the worst view of small pictures was better by 0.22 in
// another way, while it fit by 0.21 as given; views that were mirrored or cut by 0.24 to 0.31, and fit by
// 0.03 at most. Where even all views together are hardly better as given than otherwise, the shape is not
// known well enough to judge one.
constexpr double kClearOfOneView = 0.2, kClearOfTheRest = 0.05, kFitsByChance = 0.1;
constexpr int kLeastViews = 4;  // at a place where one is held against the others
constexpr double kOwnWeight = 0.25, infinity = std::numeric_limits<double>::infinity();

struct SurfacePlace {
  Eigen::Vector3d position, normal;  // world; the normal of its wider surroundings
};

// What one view's AoP says of a place. weight 0: nothing.
struct Witness {
  float weight = 0, cos4 = 0, sin4 = 0;  // of four times the AoP
  float x = 0, y = 0;                    // normalised image point
};

// Empty if it is damaged: fusion says so.
Image<float> ReadDepthIfSound(const std::filesystem::path& path) {
  try {
    return ReadDepthMap(path);
  } catch (const Error&) {
    return {};
  }
}

// Random places of the view's map.
void AddPlaces(const Image<float>& depth, const DenseView& view, Random random, int count,
               std::vector<SurfacePlace>& places) {
  const Pinhole camera = view.camera.Resized(depth.width(), depth.height());
  const Rigid world_from_cam = view.cam_from_world.Inverse();
  for (const auto& [x, y, normal] : CoarseNormals(depth, camera, count, random))
    places.push_back({world_from_cam * Eigen::Vector3d(double(depth(x, y)) * camera.Ray(x + 0.5, y + 0.5)),
                      world_from_cam.rotation * normal});
}

std::vector<Witness> Ask(const std::vector<SurfacePlace>& places, const DenseView& view,
                         const Image<float>& depth, const Image<PolarSample>& polar) {
  std::vector<Witness> witnesses(places.size());
  if (depth.empty()) return witnesses;
  const Pinhole camera = view.camera.Resized(depth.width(), depth.height());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Eigen::Vector3d p = view.cam_from_world * places[i].position;
    if (p.z() <= 0) continue;
    const Eigen::Vector2d at = camera.Project(p);
    const int x = int(std::floor(at.x())), y = int(std::floor(at.y()));
    if (!depth.Contains(x, y) || !(std::abs(depth(x, y) / float(p.z()) - 1) < kSameDepth)) continue;
    const PolarSample& sample = polar(std::min(x * polar.width() / depth.width(), polar.width() - 1),
                                      std::min(y * polar.height() / depth.height(), polar.height() - 1));
    const float cos2 = sample.cos_phi * sample.cos_phi - sample.sin_phi * sample.sin_phi,
                sin2 = 2 * sample.cos_phi * sample.sin_phi;
    witnesses[i] = {sample.weight, cos2 * cos2 - sin2 * sin2, 2 * cos2 * sin2, float(p.x() / p.z()),
                    float(p.y() / p.z())};
  }
  return witnesses;
}

// kNormals directions within the cone around an axis.
std::vector<Eigen::Vector3d> Cone(const Eigen::Vector3d& axis) {
  const Eigen::Vector3d u = axis.unitOrthogonal(), v = axis.cross(u);
  const double least = std::cos(kConeDeg * std::numbers::pi / 180);
  std::vector<Eigen::Vector3d> normals;
  for (int i = 0; i < kNormals; ++i) {
    const double cosine = 1 - (1 - least) * (i + 0.5) / kNormals, sine = std::sqrt(1 - cosine * cosine),
                 turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
    normals.push_back(cosine * axis + sine * (std::cos(turn) * u + std::sin(turn) * v));
  }
  return normals;
}

using Fits = std::array<double, 4>;  // by AopCount

// Along and across: cos cos and sin sin of four times AoP and azimuth, weighted.
Fits FitsOf(double along, double across) {
  return {along + across, along - across, -along - across, across - along};
}

// What a place says: the best that a normal in the cone does for each way to count all views, and of each
// view (nothing where it says too little) the fits to the normal that the other views, as given, ask for.
struct PlaceFits {
  Fits all;
  std::vector<std::optional<Fits>> of_view;
};

// Of one normal: per view along and across; none if a view that is a witness could not see it.
std::optional<std::vector<Eigen::Vector2d>> Agreements(const Eigen::Vector3d& normal,
                                                       const std::vector<std::vector<Witness>>& witnesses,
                                                       std::size_t index,
                                                       const std::vector<Eigen::Matrix3d>& rotations) {
  std::vector<Eigen::Vector2d> sums(witnesses.size(), Eigen::Vector2d::Zero());
  for (std::size_t v = 0; v < witnesses.size(); ++v) {
    const Witness& w = witnesses[v][index];
    if (w.weight <= 0) continue;
    const Eigen::Vector3d n = rotations[v] * normal;
    const double x = double(w.x), y = double(w.y);
    if (n.x() * x + n.y() * y + n.z() >= -kGrazingCosine) return {};
    const double a = n.x() - n.z() * x, b = -(n.y() - n.z() * y), s = a * a + b * b + 1e-12;
    const double cos2 = (a * a - b * b) / s, sin2 = 2 * a * b / s;
    sums[v] = double(w.weight) *
              Eigen::Vector2d(double(w.cos4) * (cos2 * cos2 - sin2 * sin2), double(w.sin4) * 2 * cos2 * sin2);
  }
  return sums;
}

// None if too little is known of the place.
std::optional<PlaceFits> FitsAt(const SurfacePlace& place, const std::vector<std::vector<Witness>>& witnesses,
                                std::size_t index, const std::vector<Eigen::Matrix3d>& rotations) {
  double total = 0;
  int seen_by = 0;
  for (const auto& view : witnesses) total += double(view[index].weight), seen_by += view[index].weight > 0;
  if (total < kLeastWitness) return {};
  PlaceFits fits{{-2, -2, -2, -2}, std::vector<std::optional<Fits>>(witnesses.size())};
  std::vector<double> rest(witnesses.size(), -infinity);  // the most that the other views have agreed
  for (const Eigen::Vector3d& normal : Cone(place.normal)) {
    const auto sums = Agreements(normal, witnesses, index, rotations);
    if (!sums) continue;
    const Eigen::Vector2d sum = std::accumulate(sums->begin(), sums->end(), Eigen::Vector2d(0, 0));
    const Fits all = FitsOf(sum.x() / total, sum.y() / total);
    for (std::size_t k = 0; k < all.size(); ++k) fits.all[k] = std::max(fits.all[k], all[k]);
    for (std::size_t v = 0; v < witnesses.size() && seen_by >= kLeastViews; ++v) {
      const double others = (sum - (*sums)[v]).sum(), weight = double(witnesses[v][index].weight);
      if (weight < kOwnWeight || others <= rest[v]) continue;
      rest[v] = others;
      fits.of_view[v] = FitsOf((*sums)[v].x() / weight, (*sums)[v].y() / weight);
    }
  }
  if (fits.all[0] < -1) return {};
  return fits;
}

AopFit Summary(const std::vector<Fits>& fits) {
  AopFit fit;
  fit.points = int(fits.size());
  if (fits.size() < 2) return fit;
  Fits mean = {};
  for (const Fits& f : fits)
    for (std::size_t k = 0; k < 4; ++k) mean[k] += f[k] / double(fits.size());
  const auto other = std::size_t(std::max_element(mean.begin() + 1, mean.end()) - mean.begin());
  double squares = 0;
  for (const Fits& f : fits) squares += std::pow(f[other] - f[0] - (mean[other] - mean[0]), 2);
  const double n = double(fits.size()), deviation = std::sqrt(squares / (n - 1) / n);
  fit.given = mean[0], fit.other_fit = mean[other], fit.other = AopCount(other);
  fit.sigmas = deviation > 0 ? (mean[other] - mean[0]) / deviation : 0;
  return fit;
}

// What the places say of all views, and of each.
AopFits Summaries(const std::vector<std::optional<PlaceFits>>& places, const std::vector<int>& views,
                  const Workspace& workspace) {
  std::vector<Fits> all;
  std::vector<std::vector<Fits>> of_view(views.size());
  for (const auto& place : places) {
    if (!place) continue;
    all.push_back(place->all);
    for (std::size_t v = 0; v < views.size(); ++v)
      if (place->of_view[v]) of_view[v].push_back(*place->of_view[v]);
  }
  AopFits fits{Summary(all)};
  if (fits.all.given - fits.all.other_fit < kClearOfTheRest) return fits;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const AopFit own = Summary(of_view[v]);
    if (own.IsWrong() && own.other_fit - own.given > kClearOfOneView && own.given < kFitsByChance)
      fits.odd[workspace.views[std::size_t(views[v])].name] = own;
  }
  return fits;
}

}  // namespace

bool AopFit::IsWrong() const {
  return points >= kEnoughPoints && other_fit - given > kClear && sigmas > kSure;
}

nlohmann::json ToJson(const AopFit& fit) {
  constexpr const char* kNames[] = {"as given", "mirrored", "shifted", "mirrored and shifted"};
  return {{"points", fit.points},       {"given", fit.given},   {"other", kNames[std::size_t(fit.other)]},
          {"other_fit", fit.other_fit}, {"sigmas", fit.sigmas}, {"wrong", fit.IsWrong()}};
}

AopFits CheckAop(const Workspace& workspace, const StereoOptions& options, Progress& progress) {
  if (!workspace.polarized) return {{}};
  const MapKind kind = BestMapKind(workspace);
  const std::vector<int> views = SomeViews(workspace, kind);
  StereoOptions by_noise;
  by_noise.aop_noise_deg = options.aop_noise_deg;
  std::vector<SurfacePlace> places;
  const int share = kMostPlaces / std::max(1, int(views.size()));
  for (const int view : views)
    AddPlaces(ReadDepthIfSound(workspace.DepthPath(view, kind)), workspace.views[std::size_t(view)],
              Random(1, std::uint64_t(view)), share, places);
  std::vector<std::vector<Witness>> witnesses;
  std::vector<Eigen::Matrix3d> rotations;
  progress.Begin("fit of the angles", views.size());
  for (const int view : views) {
    progress.Check();
    const DenseView& dense = workspace.views[std::size_t(view)];
    witnesses.push_back(Ask(places, dense, ReadDepthIfSound(workspace.DepthPath(view, kind)),
                            MakePolarSamples(ReadViewLight(workspace, view), by_noise)));
    rotations.push_back(dense.cam_from_world.rotation);
    progress.Advance();
  }
  std::vector<std::optional<PlaceFits>> found(places.size());
  ParallelFor(0, int(places.size()), [&](int i) {
    found[std::size_t(i)] = FitsAt(places[std::size_t(i)], witnesses, std::size_t(i), rotations);
  });
  return Summaries(found, views, workspace);
}

}  // namespace polarscan
