// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/inverse_rendering/inverse_rendering.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "core/error.h"
#include "fusion/mesh_topology.h"
#include "fusion/surface/inverse_rendering/smoothness.h"
#include "fusion/surface/inverse_rendering/vertex_cost.h"

namespace polarscan {
namespace {

constexpr double kAlbedoStep = 0.05;  // difference of neighbours' albedos that counts as an edge of texture
constexpr int kMostInnerSteps = 200;  // of conjugate gradients in one of Levenberg-Marquardt

// What is sought. moves: in units of the mean edge, from where the round began.
struct Unknowns {
  std::vector<double> moves, albedo;
  std::vector<Harmonics> lights;
};

// Stops the solver where the user asked to.
class StopWhenCancelled : public ceres::IterationCallback {
 public:
  explicit StopWhenCancelled(const Progress& progress) : progress_(progress) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return progress_.cancelled() ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }

 private:
  const Progress& progress_;
};

void AddVertexTerms(const MovingSurface& surface, const Observed& observed, Unknowns& unknowns,
                    ceres::Problem& problem) {
  for (std::uint32_t v = 0; v < unknowns.moves.size(); ++v) {
    if (observed.samples.Of(v).empty() || surface.neighbours.TrianglesOf(v).empty()) continue;
    std::vector<double*> parameters{&unknowns.moves[v]};
    for (std::uint32_t other : surface.neighbours.Of(v)) parameters.push_back(&unknowns.moves[other]);
    parameters.push_back(&unknowns.albedo[v]);
    problem.AddResidualBlock(MakeVertexCost(surface, observed, v).release(), nullptr, parameters);
  }
}

void AddFacetTerms(const MovingSurface& surface, const FacetStars& stars, double weight, Unknowns& unknowns,
                   ceres::Problem& problem) {
  for (const std::optional<FacetStar>& star : stars) {
    if (!star) continue;
    FacetCost facet = MakeFacetCost(surface, *star, weight);
    std::vector<double*> parameters;
    for (std::uint32_t v : facet.vertices) parameters.push_back(&unknowns.moves[v]);
    problem.AddResidualBlock(facet.cost.release(), nullptr, parameters);
  }
}

void AddAlbedoTerms(const VertexNeighbours& neighbours, double weight, Unknowns& unknowns,
                    ceres::LossFunction* edges, ceres::Problem& problem) {
  for (std::uint32_t v = 0; v < unknowns.albedo.size(); ++v)
    for (std::uint32_t other : neighbours.Of(v))
      if (v < other)
        problem.AddResidualBlock(MakeAlbedoCost(weight).release(), edges, &unknowns.albedo[v],
                                 &unknowns.albedo[other]);
}

void AddAnchors(const MovingSurface& surface, const TriangleMesh& first, double weight, Unknowns& unknowns,
                ceres::Problem& problem) {
  for (std::size_t v = 0; v < unknowns.moves.size(); ++v) {
    const Eigen::Vector3d moved = surface.mesh.vertices[v] - first.vertices[v];
    const double before = moved.dot(surface.mesh.normals[v]) / surface.unit;
    problem.AddResidualBlock(MakeAnchorCost(weight, before).release(), nullptr, &unknowns.moves[v]);
  }
}

ceres::Solver::Summary Solve(ceres::Problem& problem, int steps, Progress& progress) {
  StopWhenCancelled stop(progress);
  ceres::Solver::Options how;
  how.linear_solver_type = ceres::CGNR;  // inexact steps: faster than a factorisation's, and they go farther
  how.preconditioner_type = ceres::JACOBI;
  how.max_linear_solver_iterations = kMostInnerSteps;
  how.max_num_iterations = steps;
  how.num_threads = 1;
  how.logging_type = ceres::SILENT;
  how.callbacks = {&stop};
  ceres::Solver::Summary summary;
  ceres::Solve(how, &problem, &summary);
  progress.Check();
  return summary;
}

// The scale of albedos and lights is one; the mean albedo shall be 1.
void Normalise(const VertexSamples& samples, Unknowns& unknowns) {
  double sum = 0, count = 0;
  for (std::size_t v = 0; v < unknowns.albedo.size(); ++v)
    if (!samples.Of(v).empty()) sum += unknowns.albedo[v], ++count;
  if (sum <= 0) return;
  for (double& albedo : unknowns.albedo) albedo *= count / sum;
  for (Harmonics& light : unknowns.lights) light *= sum / count;
}

// What the views show now, in units of the mean intensity of the first time (scale: 0 before that).
VertexSamples LookAgain(const TriangleMesh& mesh, const SurfaceViews& views, bool polarized,
                        const MvirOptions& options, double& scale, Progress& progress) {
  VertexSamples samples = LookAt(mesh, views, polarized, options.dop_saturation, progress);
  if (samples.size() == 0)
    throw Error("no view sees anything of the mesh", std::to_string(mesh.vertices.size()) + " vertices",
                "Is it in the frame of the poses? Try --no-refine");
  if (scale == 0) scale = 1 / samples.MeanIntensity();
  samples.ScaleIntensities(scale);
  return samples;
}

// Moves of at most `unit`; a vertex may not pass its neighbours.
void Displace(TriangleMesh& mesh, const std::vector<double>& moves, double unit) {
  for (std::size_t v = 0; v < moves.size(); ++v)
    mesh.vertices[v] += unit * std::clamp(moves[v], -1.0, 1.0) * mesh.normals[v];
  ComputeVertexNormals(mesh);
}

// Lights, then moves and albedos, of the surface as it lies.
ceres::Solver::Summary Improve(const MovingSurface& surface, const TriangleMesh& first,
                               const FacetStars& stars, const VertexSamples& samples,
                               const MvirOptions& options, Unknowns& unknowns, Progress& progress) {
  unknowns.lights = FitLights(surface.mesh.normals, unknowns.albedo, samples, unknowns.lights.size());
  std::ranges::fill(unknowns.moves, 0);
  const Observed observed{samples, unknowns.lights, options.photometric, options.polarimetric};
  ceres::CauchyLoss edges(std::sqrt(options.albedo_smoothness) * kAlbedoStep);
  ceres::Problem::Options owns;
  owns.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(owns);
  AddVertexTerms(surface, observed, unknowns, problem);
  if (options.smoothness > 0) AddFacetTerms(surface, stars, options.smoothness, unknowns, problem);
  if (options.albedo_smoothness > 0)
    AddAlbedoTerms(surface.neighbours, options.albedo_smoothness, unknowns, &edges, problem);
  if (options.anchor > 0) AddAnchors(surface, first, options.anchor, unknowns, problem);
  const ceres::Solver::Summary summary = Solve(problem, options.steps, progress);
  Normalise(samples, unknowns);
  return summary;
}

}  // namespace

OptionTable Table(MvirOptions& o) {
  return {
      {"mvir-rounds", &o.rounds, "mvir: times that the views are looked at", "", 1, 1000},
      {"mvir-steps", &o.steps, "mvir: steps of the solver in a round", "", 1, 1000},
      {"mvir-photometric", &o.photometric, "mvir: weight of intensities against their rendering", "", 0, 1e9},
      {"mvir-polarimetric", &o.polarimetric, "mvir: weight of azimuths against the AoP", "", 0, 1e9},
      {"mvir-smoothness", &o.smoothness, "mvir: weight of facets being as their neighbours", "", 0, 1e9},
      {"mvir-albedo-smoothness", &o.albedo_smoothness, "mvir: weight of albedos being as their neighbours'",
       "", 0, 1e9},
      {"mvir-anchor", &o.anchor, "mvir: weight of where the vertices were; 0: as published", "", 0, 1e9},
      {"mvir-dop-saturation", &o.dop_saturation, "mvir: DoP from which an AoP counts fully", "", 1e-6, 1},
  };
}

RenderedSurface RenderInversely(const TriangleMesh& mesh, const SurfaceViews& views, bool polarized,
                                const MvirOptions& options, MvirCounts& counts, Progress& progress) {
  const std::size_t count = mesh.vertices.size();
  progress.Begin("inverse rendering", std::size_t(options.rounds), "round");
  const VertexNeighbours neighbours(count, mesh.triangles);
  const FacetStars stars = MakeFacetStars(mesh.triangles);
  Unknowns unknowns{std::vector<double>(count, 0), std::vector<double>(count, 1),
                    std::vector<Harmonics>(views.views.size())};
  TriangleMesh at = mesh;
  double scale = 0;
  for (int round = 0; round < options.rounds; ++round) {
    const VertexSamples samples = LookAgain(at, views, polarized, options, scale, progress);
    const MovingSurface surface{at, neighbours, MeanEdge(at)};
    const ceres::Solver::Summary summary =
        Improve(surface, mesh, stars, samples, options, unknowns, progress);
    if (round == 0) counts.views_per_vertex = double(samples.size()) / double(count);
    if (round == 0) counts.cost_before = summary.initial_cost / double(count);
    counts.cost_after = summary.final_cost / double(count);
    Displace(at, unknowns.moves, surface.unit);
    progress.Advance();
  }
  for (std::size_t v = 0; v < count; ++v)
    counts.mean_move += (at.vertices[v] - mesh.vertices[v]).norm() / double(count);
  return {std::move(at), std::move(unknowns.albedo), std::move(unknowns.lights)};
}

}  // namespace polarscan
