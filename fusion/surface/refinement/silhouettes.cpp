// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/refinement/silhouettes.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/parallel.h"
#include "core/statistics.h"
#include "stereo/costs/stereo_view.h"

namespace polarscan {
namespace {

constexpr double kStep = 0.5;  // px
constexpr double kBeside = 1;  // px: a vertex farther inside of the mesh's own outline does not count
constexpr int kHalvings = 4;   // of that, to find the outline

// Pixels from p along `out` to the nearest place where the object ends; nothing within reach: none.
std::optional<double> DistanceToEdge(const Image<std::uint8_t>& mask, const Eigen::Vector2d& p,
                                     const Eigen::Vector2d& out, double reach) {
  constexpr float kHalf = 127.5f;  // of a pixel belongs to the object
  std::optional<float> before = Bilinear(mask, p.x(), p.y());
  if (!before) return {};
  const double direction = *before >= kHalf ? 1 : -1;
  for (double at = kStep; at <= reach; at += kStep) {
    const Eigen::Vector2d place = p + direction * at * out;
    const std::optional<float> here = Bilinear(mask, place.x(), place.y());
    if (!here) return {};
    if ((*here >= kHalf) != (*before >= kHalf))
      return direction * (at - kStep * double((*here - kHalf) / (*here - *before)));
    before = here;
  }
  return {};
}

// Pixels from a vertex along `out` (world, one pixel long) to where rays miss the mesh, in front and behind;
// nothing within kBeside: none.
std::optional<double> DistanceToOutline(const RayCaster& caster, const Eigen::Vector3d& centre,
                                        const Eigen::Vector3d& vertex, const Eigen::Vector3d& out) {
  const auto hit = [&](double px) { return caster.Occluded(centre, vertex + px * out - centre); };
  if (hit(kBeside)) return {};
  double inside = 0, outside = kBeside;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = (inside + outside) / 2;
    (hit(middle) ? inside : outside) = middle;
  }
  return (inside + outside) / 2;
}

// Vertices that face the camera beside one that does not.
std::vector<bool> OutlineVertices(const TriangleMesh& mesh, const Eigen::Vector3d& centre) {
  std::vector<bool> facing, outline(mesh.vertices.size(), false);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    facing.push_back(mesh.normals[i].dot(centre - mesh.vertices[i]) >= 0);
  for (const auto& t : mesh.triangles)
    if (!facing[t[0]] || !facing[t[1]] || !facing[t[2]])
      for (std::uint32_t v : t) outline[v] = outline[v] || facing[v];
  return outline;
}

}  // namespace

std::vector<bool> OutsideOfMasks(const std::vector<Eigen::Vector3d>& points, const SurfaceViews& views,
                                 double margin_px, Progress& progress) {
  constexpr int kWitnesses = 2;
  const std::vector<int> places = Places(views.views);
  std::vector<int> order(places.size());  // views of one place one after the other
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](int view) { return places[std::size_t(view)]; });
  std::vector<int> witnesses(points.size(), 0), last(points.size(), -1);  // places; the last of them
  for (const int i : order) {
    progress.Check();
    const Image<std::uint8_t> mask = views.mask(i);
    if (mask.empty()) continue;
    const Image<std::uint8_t> wide = Dilate(mask, margin_px);
    const bool whole = KeepsClearOfBorder(wide);  // then what lies beside the picture lies beside the object
    const DenseView& view = views.views[std::size_t(i)];
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Eigen::Vector3d p = view.cam_from_world * points[k];
      if (p.z() <= 0) continue;
      const Eigen::Vector2d at = view.camera.Project(p);
      const int x = int(std::floor(at.x())), y = int(std::floor(at.y()));
      if (wide.Contains(x, y) ? wide(x, y) != 0 : !whole) continue;
      witnesses[k] += std::exchange(last[k], places[std::size_t(i)]) != places[std::size_t(i)];
    }
  }
  std::vector<bool> outside;
  for (int count : witnesses) outside.push_back(count >= kWitnesses);
  return outside;
}

std::vector<OutlinePull> OutlinePulls(const TriangleMesh& mesh, const RayCaster& caster,
                                      const DenseView& view, const Image<std::uint8_t>& mask,
                                      double reach_px) {
  std::vector<OutlinePull> pulls;
  const Eigen::Vector3d centre = view.cam_from_world.Center();
  const std::vector<bool> outline = OutlineVertices(mesh, centre);
  for (std::uint32_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d p = view.cam_from_world * mesh.vertices[i];
    if (!outline[i] || p.z() <= 0) continue;
    const Eigen::Vector3d n = view.cam_from_world.rotation * mesh.normals[i];
    const Eigen::Vector2d slope(view.camera.fx * (n.x() - n.z() * p.x() / p.z()) / p.z(),
                                view.camera.fy * (n.y() - n.z() * p.y() / p.z()) / p.z());  // px a unit
    const double px = slope.norm();
    if (!(px > 0)) continue;
    const auto own = DistanceToOutline(caster, centre, mesh.vertices[i], mesh.normals[i] / px);
    if (!own) continue;
    const Eigen::Vector2d out = slope / px, at = view.camera.Project(p) + *own / px * slope;
    const auto edge = DistanceToEdge(mask, at, out, reach_px);
    if (edge) pulls.push_back({i, *edge, out, 1 / px});
  }
  return pulls;
}

Silhouettes::Silhouettes(const SurfaceViews& views, double reach_px)
    : views_(views.views), reach_px_(reach_px) {
  for (int view = 0; view < int(views_.size()); ++view) masks_.push_back(views.mask(view));
}

std::vector<Pull> Silhouettes::Pulls(const TriangleMesh& mesh, Progress& progress) {
  const RayCaster caster({mesh});
  std::vector<std::vector<OutlinePull>> by_view(masks_.size());
  ParallelFor(0, int(masks_.size()), [&](int i) {
    const auto view = std::size_t(i);
    progress.Check();
    if (!masks_[view].empty())
      by_view[view] = OutlinePulls(mesh, caster, views_[view], masks_[view], reach_px_);
  });
  std::vector<double> distances;
  for (const auto& pulls : by_view)
    for (const OutlinePull& pull : pulls) distances.push_back(pull.distance_px);
  if (!bias_px_) {
    const double median = Median(distances);
    bias_px_ = std::copysign(std::max(0.0, std::abs(median) - kSubPixel), median);
  }
  for (double& distance : distances) distance = std::abs(distance - *bias_px_);
  const double spread = Median(distances) / kSubPixel, weight = 1 / (1 + spread * spread);
  std::vector<Pull> sum(mesh.vertices.size());
  for (const auto& pulls : by_view)
    for (const OutlinePull& pull : pulls) {
      Pull& to = sum[pull.vertex];
      to.move += weight * (pull.distance_px - *bias_px_) * pull.pixel, to.weight += weight;
    }
  for (Pull& pull : sum)
    if (pull.weight > 0) pull.move /= pull.weight;
  return sum;
}

}  // namespace polarscan
