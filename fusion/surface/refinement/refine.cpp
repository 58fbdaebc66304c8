// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/refinement/refine.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "fusion/mesh_topology.h"
#include "fusion/surface/refinement/mesh_views.h"
#include "fusion/surface/refinement/normal_fit.h"
#include "fusion/surface/refinement/photometric.h"
#include "fusion/surface/refinement/silhouettes.h"
#include "stereo/costs/normal_from_aop.h"

namespace polarscan {
namespace {

constexpr double kReach = 6;                // px: an outline farther from the mesh's is another's
constexpr double kFarAnchor = 0.05;         // of the anchor, where no points bear the surface out
constexpr double kNoOutlines = 10;          // times the anchor, where no mask says how thick the object is
constexpr double kBend = 0.5;               // weight of the neighbours' normals where the AoP say nothing ...
constexpr double kNoBend = 1;               // ... falling to zero where the form of the AoP has this trace
constexpr int kBendRings = 10;              // how many edges far those neighbours are
constexpr int kLookAgain = 4;               // iterations after which views are compared again ...
constexpr int kOutlineAgain = 2;            // ... and outlines
constexpr float kSoftness = 0.15f * 0.15f;  // squared sine of the angle off a sample at which it counts half

// What all views say about the mesh.
struct Observations {
  VertexConstraints aop;  // none without polarization
  SurfaceAppearance appearance;
};

Image<std::uint16_t> Quantised(const Image<float>& gray) {
  Image<std::uint16_t> out(gray.width(), gray.height());
  for (std::size_t i = 0; i < gray.size(); ++i) out.pixels()[i] = std::uint16_t(65535 * gray.pixels()[i]);
  return out;
}

bool UsesAop(const SurfaceViews& views, const RefineOptions& options) {
  return options.polarization && views.polarized;
}

// Reads some views at a time.
Observations Observe(const TriangleMesh& mesh, const SurfaceViews& views, const RefineOptions& options,
                     Progress& progress) {
  constexpr std::size_t kAtOnce = 4;
  StereoOptions evidence;
  evidence.aop_noise_deg = options.aop_noise_deg;
  const std::size_t count = views.views.size();
  const bool polarized = UsesAop(views, options), textured = options.photometric > 0;
  std::vector<std::vector<bool>> visible = VisibleVertices(mesh, views.views, progress);
  VertexConstraints aop(mesh.vertices.size(), polarized ? visible : std::vector<std::vector<bool>>());
  std::vector<Image<std::uint16_t>> grays(count);
  for (std::size_t begin = 0; begin < count && (polarized || textured); begin += kAtOnce) {
    std::vector<Image<PolarSample>> polar(std::min(kAtOnce, count - begin));
    ParallelFor(0, int(polar.size()), [&](int i) {
      progress.Check();
      const StokesImage stokes = views.light(int(begin) + i);
      if (textured) grays[begin + std::size_t(i)] = Quantised(MakeGray(stokes.s0, 1));
      if (polarized) polar[std::size_t(i)] = MakePolarSamples(stokes, evidence);
    });
    for (std::size_t i = 0; polarized && i < polar.size(); ++i)
      AddAopConstraints(mesh, views.views[begin + i], polar[i], visible[begin + i], aop);
  }
  return {std::move(aop), {std::move(visible), std::move(grays)}};
}

// What the constraints ask of a normal near `normal`, as a quadratic form. The robust sum may be indefinite
// where samples contradict each other: its negative part is left out.
Eigen::Matrix3d QuadraticForm(const AopTable& table, const Eigen::Vector3d& normal) {
  if (table.count == 0) return Eigen::Matrix3d::Zero();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
  solver.computeDirect(AopSystemSimd(table, normal.cast<float>(), kSoftness));
  const Eigen::Matrix3f& axes = solver.eigenvectors();
  return (axes * solver.eigenvalues().cwiseMax(0).asDiagonal() * axes.transpose()).cast<double>();
}

// Each vertex' normal as its surroundings have it.
std::vector<Eigen::Vector3d> SmoothNormals(const TriangleMesh& mesh, const VertexNeighbours& neighbours) {
  std::vector<Eigen::Vector3d> normals = mesh.normals, before;
  for (int ring = 0; ring < kBendRings; ++ring) {
    before = normals;
    ParallelFor(0, int(normals.size()), [&](int i) {
      const auto v = std::size_t(i);
      const auto around = neighbours.Of(v);
      Eigen::Vector3d sum = double(around.size()) * before[v];
      for (std::uint32_t other : around) sum += 2 * before[other];
      if (sum.norm() > 0) normals[v] = sum.normalized();
    });
  }
  return normals;
}

// The form of the AoP; where they say little also what bends the surface toward its neighbours' normal.
Eigen::Matrix3d WithBend(const Eigen::Matrix3d& aop, const Eigen::Vector3d& smooth) {
  const double weight = kBend * std::max(0.0, 1 - aop.trace() / kNoBend);
  return aop + weight * (Eigen::Matrix3d::Identity() - smooth * smooth.transpose());
}

// Several pulls as one.
Pull Combined(std::initializer_list<Pull> pulls) {
  Pull sum;
  for (const Pull& pull : pulls) sum.move += pull.weight * pull.move, sum.weight += pull.weight;
  sum.move /= sum.weight;
  return sum;
}

void Count(const VertexConstraints& constraints, const std::vector<Pull>& outlines,
           const Eigen::VectorXd& moved, RefineCounts& counts) {
  const auto n = double(outlines.size());
  counts = {0, moved.cwiseAbs().mean(), 0};
  for (std::size_t v = 0; v < outlines.size(); ++v)
    counts.views_per_vertex += double(constraints.CountOf(v)) / n;
  for (const Pull& pull : outlines) counts.outline_vertices += (pull.weight > 0) / n;
}

}  // namespace

OptionTable Table(RefineOptions& o) {
  return {
      {"refine", &o.refine,
       "Move the vertices until normals fit the AoP of all views, outlines the masks, and the surface looks "
       "alike in all views"},
      {"refine-iterations", &o.iterations, "Times that all vertices move", "", 1, 100, {}, "refine-rounds"},
      {"refine-anchor", &o.anchor,
       "Weight of where the vertices were, ten times as much without masks; less: the mesh follows AoP and "
       "outlines farther",
       "", 1e-6, 1e6},
      {"refine-smoothness", &o.smoothness, "Weight of moving as the neighbours do; less: finer, noisier", "",
       0, 1e6},
      {"refine-outline", &o.outline, "Weight of the masks' outlines; 0: they do not count", "", 0, 1e6},
      {"refine-photometric", &o.photometric,
       "Weight of what makes the surface look alike in all views; 0: it does not count", "", 0, 1e6},
      {"aop-noise", &o.aop_noise_deg, "AoP noise at which evidence counts half", "deg", 0.01, 90},
      {"polarization", &o.polarization, "Use the AoP"},
      {"masks", &o.masks, "Use the masks: outlines, and no surface outside of two of them"},
  };
}

bool CanRefine(const SurfaceViews& views, const RefineOptions& options) {
  return (options.masks && views.masked) || UsesAop(views, options);
}

TriangleMesh RefineMesh(const TriangleMesh& input, const std::vector<bool>& far, const SurfaceViews& views,
                        const RefineOptions& options, RefineCounts& counts, Progress& progress) {
  TriangleMesh mesh = input;
  const std::size_t count = mesh.vertices.size();
  progress.Begin("refinement", std::size_t(options.iterations) + 1, "iteration");
  const VertexNeighbours neighbours(count, mesh.triangles);
  const Observations observed = Observe(mesh, views, options, progress);
  Silhouettes silhouettes(views, kReach);
  NormalFit fit{std::vector<Eigen::Matrix3d>(count), std::vector<Pull>(count), options.smoothness};
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(Eigen::Index(count));
  std::vector<Pull> outlines(count), photometric(count);  // from where the vertices were at first
  const auto from_first = [&](std::vector<Pull> pulls) {
    for (std::size_t v = 0; v < count; ++v) pulls[v].move += moved[Eigen::Index(v)];
    return pulls;
  };
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    progress.Advance();
    if (options.photometric > 0 && iteration % kLookAgain == 0)
      photometric =
          from_first(PhotometricPulls(mesh, neighbours, views.views, observed.appearance, progress));
    if (options.masks && options.outline > 0 && iteration % kOutlineAgain == 0)
      outlines = from_first(silhouettes.Pulls(mesh, progress));
    const bool outlined = std::ranges::any_of(outlines, [](const Pull& p) { return p.weight > 0; });
    const double anchor = options.anchor * (outlined ? 1 : kNoOutlines);
    const std::vector<Eigen::Vector3d> smooth = SmoothNormals(mesh, neighbours);
    ParallelFor(0, int(count), [&](int i) {
      const auto v = std::size_t(i);
      fit.normal[v] = WithBend(QuadraticForm(observed.aop.TableOf(v), mesh.normals[v]), smooth[v]);
      fit.pulls[v] =
          Combined({{-moved[i], anchor * (far[v] ? kFarAnchor : 1)},
                    {outlines[v].move - moved[i], options.outline * outlines[v].weight},
                    {photometric[v].move - moved[i], options.photometric * photometric[v].weight}});
    });
    progress.Check();
    const Eigen::VectorXd moves = FitMoves(mesh, neighbours, fit);
    for (std::size_t v = 0; v < count; ++v) mesh.vertices[v] += moves[Eigen::Index(v)] * mesh.normals[v];
    moved += moves;
    ComputeVertexNormals(mesh);
  }
  progress.Advance();
  Count(observed.aop, outlines, moved, counts);
  return mesh;
}

}  // namespace polarscan
