// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "core/options.h"
#include "core/progress.h"
#include "fusion/cloud/cloud.h"
#include "fusion/cloud/consistency.h"
#include "stereo/workspace.h"

namespace polarscan {

// Defaults, from maps of bunny-plastic (docs/datasets.md; two good sets, one noisy; F at 0.01 of the
// radius): 0.8 px against 1: +.002, +.004, -.005; 60 degrees against 30: +.006 to +.007; the contradiction
// test at 1: -.01 to -.09.
struct FusionOptions {
  std::string maps = "auto";     // which maps: auto (geometric if there are any), geometric, photometric
  int min_views = 3;             // views that must agree on a point, the first one included
  double reprojection_px = 0.8;  // how far apart two views' points may lie, seen from the first
  double relative_depth = 0.01;  // how much their depths may differ, as a share
  double normal_deg = 60;        // how much their normals may differ
  int check_views = 50;          // views asked about a pixel at most: those that overlap most
  double contradictions =
      0.5;                 // drop a point that this many times more views see through than agree; 0: never
  bool masks = true;       // pixels outside of masks/NAME.png make no points
  double memory_gb = 2.5;  // maps kept in memory (23 bytes a pixel; at least check_views + 1 views' maps)
};
OptionTable Table(FusionOptions& options);

// What became of the pixels; each pixel with a depth ends in exactly one of the lines after `with_depth`.
struct FusionCounts {
  std::size_t inside = 0, outside = 0;  // of the masks, with a depth or without
  std::size_t with_depth = 0;
  std::size_t masked = 0;  // outside of the mask
  std::size_t without_normal = 0;
  std::size_t absorbed = 0;       // part of a point that an earlier pixel began
  std::size_t too_few_views = 0;  // fewer views agree than asked for
  std::size_t contradicted = 0;   // too many views see through the point
  std::size_t points = 0;
  ConsistencyCounts asked;  // how the single questions ended
};

struct CloudSummary {
  std::size_t points = 0;
  int views = 0;                     // with sound maps
  std::vector<std::string> damaged;  // views left out
  std::string maps;                  // their kind (stereo/map_kind.h)
  double mean_views = 0, mean_confidence = 0, mean_dop = 0;
  double neighbour_deg = 0;  // between neighbouring views (NeighbourAngle)
  FusionCounts counts;
};
nlohmann::json ToJson(const CloudSummary& summary);

// The share of the pixels with a depth on which too few views agree. 0 for counts that do not tell.
double ShareOfTooFew(const nlohmann::json& summary);
// Where that is more than half: what is wrong and what to add, in words; else empty. summary: of ToJson.
std::string FewAgree(const nlohmann::json& summary, int min_views);
// The same where few pixels inside of the masks, or of the pictures without masks, have a depth at all,
// though views are near each other: wrong poses, say, whose depths stereo has left out already.
std::string FewDepths(const nlohmann::json& summary);
// What there is to say of the two.
std::vector<std::string> Doubts(const nlohmann::json& summary, int min_views);

// Fuses the depth maps of a workspace into a cloud (fusion/cloud/cloud.h). Views are taken in order; each
// pixel that no earlier point has absorbed asks the overlapping views whether they agree
// (fusion/cloud/consistency.h); with enough of them it becomes a point and absorbs their pixels. Same bytes
// for any number of threads and any memory limit. Views without maps, and those of which a file is damaged,
// are left out with a warning, as if they had never been there. Memory: maps as the options say, a bit for
// each pixel of all views; points go to the file as they come. Throws Error if there are no maps, or if
// nothing is consistent (with the counts of why).
CloudSummary FuseCloud(const std::filesystem::path& dense, const std::filesystem::path& cloud_ply,
                       const FusionOptions& options, Progress& progress);
CloudSummary FuseCloud(const Workspace& workspace, const std::filesystem::path& cloud_ply,
                       const FusionOptions& options, Progress& progress);

// The same of these maps instead of options.maps, in memory (40 bytes a point), as ReadCloud would give them.
std::vector<CloudPoint> FusePoints(const Workspace& workspace, const MapKind& maps,
                                   const FusionOptions& options, Progress& progress);

}  // namespace polarscan
