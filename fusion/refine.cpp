// SPDX-License-Identifier: Apache-2.0
#include "fusion/refine.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/parallel.h"
#include "fusion/mesh_views.h"
#include "fusion/normal_fit.h"
#include "stereo/rounds/aop_table.h"

namespace polarscan {
namespace {

constexpr double kReach = 6;                // px: an outline farther from the mesh's is another's
constexpr double kFarAnchor = 0.05;         // of the anchor, where no points bear the surface out
constexpr double kNoOutlines = 10;          // times the anchor, where no mask says how thick the object is
constexpr double kBend = 0.5;               // weight of the neighbours' normals where the AoP say nothing ...
constexpr double kNoBend = 1;               // ... falling to zero where the form of the AoP has this trace
constexpr int kBendRings = 10;              // how many edges far those neighbours are
constexpr float kSoftness = 0.15f * 0.15f;  // squared sine of the angle off a sample at which it counts half

// The constraints of all views, read one after the other.
VertexConstraints AllConstraints(const TriangleMesh& mesh, const Workspace& workspace, bool polarization,
                                 Progress& progress) {
  if (!polarization || !workspace.polarized) return VertexConstraints(mesh.vertices.size());
  const auto visible = VisibleVertices(mesh, workspace, progress);
  VertexConstraints constraints(mesh.vertices.size());
  StereoOptions options;
  options.masks = false;  // nothing here asks for them
  for (int view = 0; view < int(workspace.views.size()); ++view) {
    progress.Check();
    AddAopConstraints(mesh, LoadStereoView(workspace, view, 1, options), visible[std::size_t(view)],
                      constraints);
  }
  return constraints;
}

// What the constraints ask of a normal near `normal`, as a quadratic form. The robust sum may be indefinite
// where samples contradict each other: its negative part is left out.
Eigen::Matrix3d QuadraticForm(const std::vector<AopConstraint>& constraints, const Eigen::Vector3d& normal) {
  if (constraints.empty()) return Eigen::Matrix3d::Zero();
  AopTable table;
  for (const AopConstraint& constraint : constraints) table.Add(constraint);
  table.Pad();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
  solver.computeDirect(AopSystemSimd(table, normal.cast<float>(), kSoftness));
  const Eigen::Matrix3f& axes = solver.eigenvectors();
  return (axes * solver.eigenvalues().cwiseMax(0).asDiagonal() * axes.transpose()).cast<double>();
}

// Each vertex' normal as its neighbours have it.
std::vector<Eigen::Vector3d> SmoothNormals(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> normals = mesh.normals, sums(normals.size());
  for (int ring = 0; ring < kBendRings; ++ring) {
    sums.assign(normals.size(), Eigen::Vector3d::Zero());
    for (const Triangle& t : mesh.triangles) {
      const Eigen::Vector3d sum = normals[t[0]] + normals[t[1]] + normals[t[2]];
      for (std::uint32_t v : t) sums[v] += sum;
    }
    for (std::size_t v = 0; v < normals.size(); ++v)
      if (sums[v].norm() > 0) normals[v] = sums[v].normalized();
  }
  return normals;
}

// The form of the AoP; where they say little also what bends the surface toward its neighbours' normal.
Eigen::Matrix3d WithBend(const Eigen::Matrix3d& aop, const Eigen::Vector3d& smooth) {
  const double weight = kBend * std::max(0.0, 1 - aop.trace() / kNoBend);
  return aop + weight * (Eigen::Matrix3d::Identity() - smooth * smooth.transpose());
}

// The anchor pulls back to where the vertex was, the outline to the mask's edge: together one pull.
Pull Together(double anchor, double moved, const Pull& outline, double outline_weight) {
  const double weight = outline_weight * outline.weight;
  return {(weight * outline.move - anchor * moved) / (anchor + weight), anchor + weight};
}

void Count(const VertexConstraints& constraints, const std::vector<Pull>& outlines,
           const Eigen::VectorXd& moved, RefineCounts& counts) {
  const auto n = double(constraints.size());
  counts = {0, moved.cwiseAbs().mean(), 0};
  for (const auto& of_vertex : constraints) counts.views_per_vertex += double(of_vertex.size()) / n;
  for (const Pull& pull : outlines) counts.outline_vertices += (pull.weight > 0) / n;
}

}  // namespace

OptionTable Table(RefineOptions& o) {
  return {
      {"refine", &o.refine,
       "Move the vertices until normals fit the AoP of all views and outlines the masks"},
      {"refine-rounds", &o.rounds, "Times that all vertices move", "", 1, 100},
      {"refine-anchor", &o.anchor,
       "Weight of where the vertices were, ten times as much without masks; less: the mesh follows AoP and "
       "outlines farther",
       "", 1e-6, 1e6},
      {"refine-smoothness", &o.smoothness, "Weight of moving as the neighbours do; less: finer, noisier", "",
       0, 1e6},
      {"refine-outline", &o.outline, "Weight of the masks' outlines; 0: only the AoP counts", "", 0, 1e6},
      {"polarization", &o.polarization, "Use the AoP"},
      {"masks", &o.masks, "Use the masks: outlines, and no surface outside of two of them"},
  };
}

bool CanRefine(const Workspace& workspace, const RefineOptions& options) {
  bool masks = false;
  for (int view = 0; options.masks && view < int(workspace.views.size()); ++view)
    masks = masks || std::filesystem::exists(workspace.MaskPath(view));
  return masks || (options.polarization && workspace.polarized);
}

TriangleMesh RefineMesh(const TriangleMesh& input, const std::vector<bool>& far, const Workspace& workspace,
                        const RefineOptions& options, RefineCounts& counts, Progress& progress) {
  TriangleMesh mesh = input;
  const std::size_t count = mesh.vertices.size();
  progress.Begin("refinement", std::size_t(options.rounds) + 1, "round");
  const VertexConstraints constraints = AllConstraints(mesh, workspace, options.polarization, progress);
  Silhouettes silhouettes(workspace, kReach);
  NormalFit fit{std::vector<Eigen::Matrix3d>(count), std::vector<Pull>(count), options.smoothness};
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(Eigen::Index(count));
  std::vector<Pull> outlines(count);
  for (int round = 0; round < options.rounds; ++round) {
    progress.Advance();
    if (options.masks && options.outline > 0) outlines = silhouettes.Pulls(mesh, progress);
    const bool outlined = std::ranges::any_of(outlines, [](const Pull& p) { return p.weight > 0; });
    const double anchor = options.anchor * (outlined ? 1 : kNoOutlines);
    const std::vector<Eigen::Vector3d> smooth = SmoothNormals(mesh);
    ParallelFor(0, int(count), [&](int i) {
      const auto v = std::size_t(i);
      fit.normal[v] = WithBend(QuadraticForm(constraints[v], mesh.normals[v]), smooth[v]);
      fit.pulls[v] = Together(anchor * (far[v] ? kFarAnchor : 1), moved[i], outlines[v], options.outline);
    });
    progress.Check();
    const Eigen::VectorXd moves = FitMoves(mesh, fit);
    for (std::size_t v = 0; v < count; ++v) mesh.vertices[v] += moves[Eigen::Index(v)] * mesh.normals[v];
    moved += moves;
    ComputeVertexNormals(mesh);
  }
  progress.Advance();
  Count(constraints, outlines, moved, counts);
  return mesh;
}

}  // namespace polarscan
