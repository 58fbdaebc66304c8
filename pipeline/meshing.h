// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "core/mesh.h"
#include "core/options.h"
#include "core/progress.h"
#include "fusion/cloud/cloud.h"
#include "fusion/surface/inverse_rendering/inverse_rendering.h"
#include "fusion/surface/refinement/refine.h"
#include "stereo/workspace.h"

namespace polarscan {

constexpr double kHullWorthSaying = 0.02;  // share of the mesh's area

// What the mesh stage can be told. Help and ranges are in Table().
struct MeshOptions {
  int depth = 0;
  double min_confidence = 0;
  double trim_cells = 1;
  double largest_hole = 0.2;
  double min_piece = 0.01;
  double edge_px = 1.5;
  double silhouette_margin_px = 2;
  int faces = 0;
  bool hull_support = true;
  std::string from;
  RefineOptions refinement;
  std::string refine_method = "own";
  MvirOptions mvir;
};
OptionTable Table(MeshOptions& options);

struct MeshSummary {
  std::size_t vertices = 0, faces = 0;
  std::size_t points = 0;  // of the cloud that were used
  int depth = 0;           // of the octree
  double cell = 0;         // its width, world units
  bool closed = false;     // no border
  int holes_filled = 0, holes_open = 0, pieces_dropped = 0;
  bool refined = false;
  RefineCounts refinement;
  std::string refine_method;  // that refined it
  MvirCounts mvir;            // if that was "mvir"
  double filled_area = 0;     // share of the surface that fills holes: nothing was seen there
  double hull_area = 0;       // share of it that is known from masks and AoP alone (pipeline/hull_support.h)
};
nlohmann::json ToJson(const MeshSummary& summary);

// What MakeMesh would do with this cloud: points, depth and cell of the summary; writes nothing.
MeshSummary PlanMesh(const std::filesystem::path& cloud_ply, const MeshOptions& options);

// The surface of a cloud: a Poisson surface (fusion/surface/poisson/poisson.h), closed or cut where there are
// no points (fusion/surface/fill_holes.h), or the mesh `from` as it is; and where there is polarization or a
// mask its triangles divided to the size of their pixels and refined by them
// (fusion/surface/refinement/refine.h, or the rival fusion/surface/inverse_rendering/inverse_rendering.h,
// which also works without either).
struct CloudSurface {
  TriangleMesh mesh;
  std::vector<bool> far;  // vertices that no points bear out
};
// Is shown the surface before it is refined; whether it is to be.
using GoesOn = std::function<bool(const TriangleMesh& unrefined)>;
CloudSurface MakeSurface(const std::vector<CloudPoint>& cloud, const Workspace& workspace,
                         const MeshOptions& options, MeshSummary& summary, Progress& progress,
                         const GoesOn& goes_on = {});

// World units that a pixel of the view that sees it best covers at a point of the cloud: the median. 0 if no
// view sees any.
double PixelSize(const std::vector<CloudPoint>& cloud, const Workspace& workspace);

// The surface of a scan's cloud, with fewer faces if asked for (fusion/surface/simplify.h), and with the
// colours of the nearest points; written to `mesh_ply`. Same bytes for any number of threads. Throws Error if
// the cloud is missing, has no normals, or makes no surface.
MeshSummary MakeMesh(const std::filesystem::path& cloud_ply, const std::filesystem::path& dense,
                     const std::filesystem::path& mesh_ply, const MeshOptions& options, Progress& progress);

}  // namespace polarscan
