// SPDX-License-Identifier: Apache-2.0
#include "pipeline/meshing.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "core/statistics.h"
#include "fusion/mesh_topology.h"
#include "fusion/surface/dress_mesh.h"
#include "fusion/surface/fill_holes.h"
#include "fusion/surface/nearest_points.h"
#include "fusion/surface/poisson/poisson.h"
#include "fusion/surface/refinement/silhouettes.h"
#include "fusion/surface/simplify.h"
#include "pipeline/hull_support.h"
#include "pipeline/workspace_views.h"
#include "stereo/costs/stereo_view.h"
#include "stereo/dense/load_view.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFewestPoints = 100;
constexpr std::size_t kMostVertices = 2'000'000;  // of a mesh whose triangles were divided

std::vector<CloudPoint> ConfidentPoints(const fs::path& cloud_ply, double min_confidence) {
  if (!fs::exists(cloud_ply))
    throw Error("there is no cloud", cloud_ply.string(), "Run polarscan fuse first");
  std::vector<CloudPoint> cloud = ReadCloud(cloud_ply);
  const std::size_t all = cloud.size();
  std::erase_if(cloud, [&](const CloudPoint& p) { return p.confidence < min_confidence; });
  if (cloud.size() < kFewestPoints)
    throw NothingFound(
        fmt::format("{} of {} points are sure enough for a mesh, which needs {}", cloud.size(), all,
                    kFewestPoints),
        cloud_ply.string(),
        all < kFewestPoints
            ? "Views agree on hardly anything: take pictures nearer to each other, about 20 degrees "
              "apart, check the poses (polarscan report), or go on with --no-mesh"
            : "Lower --mesh-min-confidence, fuse with looser limits, or go on with --no-mesh");
  return cloud;
}

MeshSummary PlanSurface(const std::vector<CloudPoint>& cloud, const MeshOptions& options) {
  if (options.depth > 0 && options.depth < kCoarsestDepth)
    throw Error("option out of range", fmt::format("--mesh-depth {}", options.depth),
                fmt::format("It must be 0, or {} to 13", kCoarsestDepth));
  MeshSummary summary;
  summary.points = cloud.size();
  summary.depth = options.depth > 0 ? options.depth : PoissonDepth(cloud);
  summary.cell = PoissonCell(cloud, summary.depth);
  return summary;
}

// The Poisson surface, honest about where there are no points, and where the masks say that there is nothing.
// far: vertices inside of its membranes.
TriangleMesh SurfaceOf(const std::vector<CloudPoint>& cloud, const Workspace& workspace,
                       const MeshOptions& options, std::vector<bool>& far, MeshSummary& summary,
                       Progress& progress) {
  TriangleMesh mesh = PoissonSurface(cloud, summary.depth, progress);
  for (double distance : NearestDistances(Positions(cloud), mesh.vertices))
    far.push_back(distance > options.trim_cells * summary.cell);
  if (options.refinement.masks) {
    const std::vector<bool> outside =
        OutsideOfMasks(mesh.vertices, ViewsOfWorkspace(workspace), options.silhouette_margin_px, progress);
    for (std::size_t i = 0; i < far.size(); ++i) far[i] = far[i] || outside[i];
  }
  HoleCounts counts;
  mesh = FillHoles(mesh, far, {options.largest_hole, options.min_piece}, counts, progress);
  if (mesh.triangles.empty())
    throw NothingFound("no surface is left after trimming", workspace.folder.string(),
                       "Raise --mesh-trim, or lower --mesh-min-piece");
  summary.holes_filled = counts.filled, summary.holes_open = counts.open;
  summary.pieces_dropped = counts.pieces, summary.filled_area = counts.filled_area;
  return mesh;
}

// The user's mesh, from the frame of the given poses into the workspace's.
CloudSurface GivenSurface(const std::vector<CloudPoint>& cloud, const Workspace& workspace,
                          const MeshOptions& options, const MeshSummary& summary) {
  CloudSurface surface{ReadMesh(options.from), {}};
  if (surface.mesh.triangles.empty()) throw Error("a mesh without triangles", options.from);
  for (Eigen::Vector3d& vertex : surface.mesh.vertices) vertex -= workspace.offset;
  ComputeVertexNormals(surface.mesh);
  for (double distance : NearestDistances(Positions(cloud), surface.mesh.vertices))
    surface.far.push_back(distance > options.trim_cells * summary.cell);
  return surface;
}

// Refined, if that was asked for and there is something to go by; for that its triangles get as small as
// pixels.
void Refine(CloudSurface& surface, const std::vector<CloudPoint>& cloud, const Workspace& workspace,
            const MeshOptions& options, MeshSummary& summary, Progress& progress) {
  if (!options.refinement.refine) return;
  const SurfaceViews views = ViewsOfWorkspace(workspace);
  const bool mvir = options.refine_method == "mvir";
  if (!mvir && !CanRefine(views, options.refinement))
    return progress.Info("there is neither polarization nor a mask: the mesh is not refined");
  const double edge = options.edge_px * PixelSize(cloud, workspace);
  while (edge > 0 && MeanEdge(surface.mesh) > edge && 4 * surface.mesh.vertices.size() < kMostVertices)
    surface.mesh = Subdivided(surface.mesh, surface.far);
  surface.mesh =
      mvir ? RenderInversely(surface.mesh, views, options.refinement.polarization && views.polarized,
                             options.mvir, summary.mvir, progress)
                 .mesh
           : RefineMesh(surface.mesh, surface.far, views, options.refinement, summary.refinement, progress);
  summary.refined = true;
  summary.refine_method = options.refine_method;
}

// Of the mesh's area.
double ShareFarFrom(const std::vector<CloudPoint>& cloud, const TriangleMesh& mesh, double distance) {
  const std::vector<double> distances = NearestDistances(Positions(cloud), mesh.vertices);
  double far = 0, all = 0;
  for (const Triangle& t : mesh.triangles) {
    const double area = TriangleArea(mesh, t);
    all += area, far += distances[t[0]] > distance ? area : 0;
  }
  return all > 0 ? far / all : 0;
}

}  // namespace

OptionTable Table(MeshOptions& o) {
  OptionTable table = {
      {"mesh-depth", &o.depth,
       "Octree depth of the surface; each step doubles detail and time; 0: as fine as the cloud's points; "
       "else at least 5",
       "", 0, 13},
      {"mesh-min-confidence", &o.min_confidence, "Points with less confidence make no surface", "", 0, 1},
      {"mesh-trim", &o.trim_cells,
       "Surface farther than this from all points is a hole: filled by a membrane, or cut out", "cells", 0.1,
       1e6},
      {"mesh-fill-holes",
       &o.largest_hole,
       "Largest hole that is filled, as a share of the surface; 0: none is; 1000: the mesh is watertight",
       "",
       0,
       1e9,
       {},
       "mesh-close"},
      {"mesh-min-piece", &o.min_piece, "Smallest piece that is kept, as a share of the largest", "", 0, 1},
      {"mesh-edge", &o.edge_px,
       "Refinement divides triangles until their edges are this long in the pictures; 0: it does not", "px",
       0, 1000},
      {"faces", &o.faces, "Triangles of the mesh at most; 0: as many as it has", "", 0, 1e9},
      {"hull-support", &o.hull_support,
       "Where the cloud covers too little of the object, complete its surface by the masks' hull, refined by "
       "AoP"},
      {"silhouette-margin", &o.silhouette_margin_px,
       "Surface outside of two views' masks by more than this is a hole, too", "px", 0, 100},
      {"mesh-from", &o.from,
       "This mesh (PLY, OBJ, STL; in the frame of the poses) instead of the cloud's; holes stay as they are"},
      {"refine-method",
       &o.refine_method,
       "own: our refinement; mvir: Polarimetric MVIR (rendering, AoP and smoothness at once), a rival",
       "",
       0,
       0,
       {"own", "mvir"}},
  };
  for (const OptionTable& part : {Table(o.refinement), Table(o.mvir)})
    table.insert(table.end(), part.begin(), part.end());
  return table;
}

nlohmann::json ToJson(const MeshSummary& s) {
  nlohmann::json json = {{"vertices", s.vertices},
                         {"faces", s.faces},
                         {"points", s.points},
                         {"depth", s.depth},
                         {"cell", s.cell},
                         {"watertight", s.closed},
                         {"holes_filled", s.holes_filled},
                         {"holes_open", s.holes_open},
                         {"pieces_dropped", s.pieces_dropped},
                         {"filled_area", s.filled_area},
                         {"hull_area", s.hull_area},
                         {"refined", s.refined}};
  if (s.refined && s.refine_method == "mvir")
    json["refinement"] = {{"method", s.refine_method},
                          {"views_per_vertex", s.mvir.views_per_vertex},
                          {"mean_move", s.mvir.mean_move},
                          {"cost_before", s.mvir.cost_before},
                          {"cost_after", s.mvir.cost_after}};
  else if (s.refined)
    json["refinement"] = {{"views_per_vertex", s.refinement.views_per_vertex},
                          {"mean_move", s.refinement.mean_move},
                          {"outline_vertices", s.refinement.outline_vertices}};
  return json;
}

MeshSummary PlanMesh(const fs::path& cloud_ply, const MeshOptions& options) {
  return PlanSurface(ConfidentPoints(cloud_ply, options.min_confidence), options);
}

double PixelSize(const std::vector<CloudPoint>& cloud, const Workspace& workspace) {
  std::vector<double> sizes;
  for (std::size_t i = 0; i < cloud.size(); i += 1 + cloud.size() / 1000) {
    double least = 1e30;
    for (const DenseView& view : workspace.views) {
      const Eigen::Vector3d p = view.cam_from_world * cloud[i].position.cast<double>();
      if (view.camera.Sees(p)) least = std::min(least, p.z() / view.camera.fx);
    }
    if (least < 1e30) sizes.push_back(least);
  }
  return Median(std::move(sizes));
}

CloudSurface MakeSurface(const std::vector<CloudPoint>& cloud, const Workspace& workspace,
                         const MeshOptions& options, MeshSummary& summary, Progress& progress,
                         const GoesOn& goes_on) {
  CloudSurface surface;
  summary = PlanSurface(cloud, options);
  if (options.from.empty())
    surface.mesh = SurfaceOf(cloud, workspace, options, surface.far, summary, progress);
  else
    surface = GivenSurface(cloud, workspace, options, summary);
  progress.Check();
  if (!goes_on || goes_on(surface.mesh)) Refine(surface, cloud, workspace, options, summary, progress);
  return surface;
}

MeshSummary MakeMesh(const fs::path& cloud_ply, const fs::path& dense, const fs::path& mesh_ply,
                     const MeshOptions& options, Progress& progress) {
  std::vector<CloudPoint> cloud = ConfidentPoints(cloud_ply, options.min_confidence);
  const Workspace workspace = ReadWorkspace(dense);
  MeshOptions helping = options;
  helping.refinement.polarization =
      options.refinement.polarization &&
      AopIsInformative(workspace, options.refinement.masks, options.refinement.aop_noise_deg);
  MeshSummary summary;
  const std::size_t measured = cloud.size();  // the hull's points come behind
  HullSupport hull(helping.refinement);
  const bool completed =
      options.hull_support && options.from.empty() && hull.AddTo(cloud, workspace, progress);
  if (completed) helping.refinement.photometric *= HullSupport::kPhotometric;
  TriangleMesh mesh = MakeSurface(cloud, workspace, helping, summary, progress).mesh;
  cloud.resize(measured);
  summary.points = measured;
  if (completed) summary.hull_area = ShareFarFrom(cloud, mesh, options.trim_cells * summary.cell);
  if (summary.hull_area >= kHullWorthSaying)
    progress.Warn(fmt::format(
        "on {:.0f} % of the mesh's surface views agree on nothing: there it is known from the masks' "
        "outlines{} alone",
        100 * summary.hull_area,
        workspace.polarized && helping.refinement.polarization ? " and the AoP" : ""));
  if (options.faces > 0 && mesh.triangles.size() > std::size_t(options.faces))
    mesh = Simplify(mesh, options.faces);
  if (options.faces > 0 && double(mesh.triangles.size()) > 1.1 * options.faces)
    progress.Warn(
        fmt::format("{} triangles instead of {}: its topology (pieces, handles, borders) allows no fewer",
                    mesh.triangles.size(), options.faces));
  summary.vertices = mesh.vertices.size(), summary.faces = mesh.triangles.size();
  summary.closed = BorderLoops(mesh.triangles).empty();
  SurfaceMesh dressed = DressMesh(mesh, cloud, summary.cell, options.trim_cells * summary.cell);
  dressed.offset = workspace.offset;
  WriteMeshFile(mesh_ply, dressed);
  return summary;
}

}  // namespace polarscan
