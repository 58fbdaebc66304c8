// SPDX-License-Identifier: Apache-2.0
#include "pipeline/hull_support.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "core/parallel.h"
#include "fusion/mesh_topology.h"
#include "fusion/surface/poisson/poisson.h"
#include "fusion/surface/refinement/mesh_views.h"
#include "fusion/surface/refinement/silhouettes.h"
#include "pipeline/workspace_views.h"
#include "stereo/costs/stereo_view.h"
#include "stereo/dense/masks/hull_surface.h"

namespace polarscan {
namespace {

constexpr int kCellPx = 4;         // of the pictures: one point covers a cell
constexpr double kCovered = 0.97;  // of the object's cells: more need no hull
constexpr double kWhole = 0.5;     // share of the masks that keep clear of the picture's border, at least
constexpr double kOutside = 0.05;  // share of the cloud that may lie outside of the masks ...
constexpr double kMarginPx = 3;    // ... by more than this
constexpr std::size_t kAskedPoints = 5000;             // of the cloud
constexpr int kHullDepth = 6;                          // of the octree of the hull's surface, at most
constexpr int kRefinements = 6, kFineRefinements = 2;  // of the hull; of a hull with smaller triangles
constexpr double kOutlines = 5, kHold = 0.01;          // the outlines are sure, where the hull was is not
constexpr double kFineEdgePx = 2, kSpacingPx = 0.9;
constexpr std::size_t kMostRefined = 400'000;  // vertices

// Where a view has points of the cloud that face it, in cells of its picture.
Image<std::uint8_t> CellsWithPoints(const std::vector<CloudPoint>& cloud, const DenseView& view) {
  Image<std::uint8_t> cells(view.camera.width / kCellPx + 1, view.camera.height / kCellPx + 1);
  const Eigen::Vector3d centre = view.cam_from_world.Center();
  for (const CloudPoint& point : cloud) {
    const Eigen::Vector3d world = point.position.cast<double>(), p = view.cam_from_world * world;
    if (point.normal.cast<double>().dot(centre - world) <= 0 || !view.camera.Sees(p)) continue;
    const Eigen::Vector2d at = view.camera.Project(p) / kCellPx;
    cells(int(at.x()), int(at.y())) = 255;
  }
  return cells;
}

// What the cloud covers of the object in all pictures.
struct Coverage {
  std::vector<Image<std::uint8_t>> cells;  // of each view
  double share = 1;
  double whole = 0;  // share of the masks that keep clear of their picture's border
};

Coverage CoverageOf(const std::vector<CloudPoint>& cloud, const SurfaceViews& views, Progress& progress) {
  const std::size_t count = views.views.size();
  Coverage coverage{std::vector<Image<std::uint8_t>>(count)};
  std::vector<std::size_t> object(count), covered(count), whole(count), masked(count);
  ParallelFor(0, int(count), [&](int view) {
    progress.Check();
    const auto i = std::size_t(view);
    const Image<std::uint8_t>& cells = coverage.cells[i] = CellsWithPoints(cloud, views.views[i]);
    const Image<std::uint8_t> mask = views.mask(view);
    masked[i] = !mask.empty();
    whole[i] = !mask.empty() && KeepsClearOfBorder(mask);
    for (int y = kCellPx / 2; y < mask.height(); y += kCellPx)
      for (int x = kCellPx / 2; x < mask.width(); x += kCellPx)
        if (mask(x, y)) ++object[i], covered[i] += cells(x / kCellPx, y / kCellPx) != 0;
  });
  const auto sum = [](const std::vector<std::size_t>& of) {
    return double(std::accumulate(of.begin(), of.end(), std::size_t(0)));
  };
  if (sum(object) > 0) coverage.share = sum(covered) / sum(object), coverage.whole = sum(whole) / sum(masked);
  return coverage;
}

// Whether the masks hold the cloud to be in the object.
bool MasksHold(const std::vector<CloudPoint>& cloud, const SurfaceViews& views, Progress& progress) {
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < cloud.size(); i += 1 + cloud.size() / kAskedPoints)
    points.push_back(cloud[i].position.cast<double>());
  const std::vector<bool> outside = OutsideOfMasks(points, views, kMarginPx, progress);
  return double(std::ranges::count(outside, true)) <= kOutside * double(points.size());
}

// The triangles of a surface at one of whose corners no view that sees it has points of the cloud.
TriangleMesh Unseen(const TriangleMesh& mesh, const SurfaceViews& views, const Coverage& coverage,
                    Progress& progress) {
  const auto visible = VisibleVertices(mesh, views.views, progress);
  std::vector<std::uint8_t> seen(mesh.vertices.size());
  ParallelFor(0, int(mesh.vertices.size()), [&](int vertex) {
    const auto v = std::size_t(vertex);
    for (std::size_t i = 0; i < visible.size() && !seen[v]; ++i) {
      if (!visible[i][v]) continue;
      const DenseView& view = views.views[i];
      const Eigen::Vector2d at = view.camera.Project(view.cam_from_world * mesh.vertices[v]) / kCellPx;
      seen[v] = coverage.cells[i](int(at.x()), int(at.y())) != 0;
    }
  });
  std::vector<bool> keep;
  for (const auto& t : mesh.triangles) keep.push_back(!seen[t[0]] || !seen[t[1]] || !seen[t[2]]);
  TriangleMesh unseen = KeepTriangles(mesh, keep).mesh;
  ComputeVertexNormals(unseen);
  return unseen;
}

TriangleMesh Finer(const TriangleMesh& mesh) {
  std::vector<bool> marks(mesh.vertices.size());
  return Subdivided(mesh, marks);
}

}  // namespace

HullSupport::HullSupport(const RefineOptions& refinement) : refinement_(refinement) {
  refinement_.photometric = 0;  // far from the surface, windows look alike in wrong places
  refinement_.outline = kOutlines;
  refinement_.anchor = kHold;
}

const TriangleMesh& HullSupport::Hull(const SurfaceViews& views, double pixel, Progress& progress) {
  const auto same = [](const DenseView& view, const Rigid& pose) {
    return view.cam_from_world.rotation == pose.rotation &&
           view.cam_from_world.translation == pose.translation;
  };
  if (hull_ && std::ranges::equal(views.views, poses_, same)) return *hull_;
  poses_.clear();
  for (const DenseView& view : views.views) poses_.push_back(view.cam_from_world);
  std::vector<CloudPoint> points;
  for (const HullPoint& p : HullSurface(views.views, views.mask, progress))
    points.push_back({p.position, p.normal, {}});
  hull_ = points.empty() ? TriangleMesh()
                         : PoissonSurface(points, std::min(kHullDepth, PoissonDepth(points)), progress);
  ComputeVertexNormals(*hull_);
  RefineCounts counts;
  const auto refine = [&](int times) {
    for (int i = 0; i < times; ++i)
      hull_ =
          RefineMesh(*hull_, std::vector<bool>(hull_->vertices.size()), views, refinement_, counts, progress);
  };
  if (hull_->triangles.empty()) return *hull_;
  refine(kRefinements);
  while (MeanEdge(*hull_) > kFineEdgePx * pixel && 4 * hull_->vertices.size() < kMostRefined) {
    hull_ = Finer(*hull_);
    refine(kFineRefinements);
  }
  return *hull_;
}

bool HullSupport::AddTo(std::vector<CloudPoint>& cloud, const Workspace& workspace, Progress& progress) {
  const SurfaceViews views = ViewsOfWorkspace(workspace);
  if (!refinement_.masks || !views.masked) return false;
  const Coverage coverage = CoverageOf(cloud, views, progress);
  if (coverage.share >= kCovered || coverage.whole < kWhole || !MasksHold(cloud, views, progress))
    return false;
  const double pixel = MiddlePixel(views.views);  // not PixelSize's: the hull must not depend on the cloud
  TriangleMesh unseen = Unseen(Hull(views, pixel, progress), views, coverage, progress);
  if (unseen.triangles.empty()) return false;
  while (MeanEdge(unseen) > kSpacingPx * pixel) unseen = Finer(unseen);
  for (std::size_t v = 0; v < unseen.vertices.size(); ++v)
    cloud.push_back({unseen.vertices[v].cast<float>(), unseen.normals[v].cast<float>(), {}});
  progress.Info(fmt::format("views agree on {:.0f} % of the object: the masks' hull completes its surface",
                            100 * coverage.share));
  return true;
}

}  // namespace polarscan
