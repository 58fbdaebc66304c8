// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <map>
#include <vector>

#include "stereo/sfm/colmap/colmap.h"
#include "stereo/sfm/colmap/database.h"
#include "stereo/sfm/sfm.h"
#include "stereo/sfm/view_list.h"

namespace polarscan {

// Up to so many pictures all pairs are matched by themselves: 780.
constexpr std::size_t kExhaustiveLimit = 40;

// Structure from motion by COLMAP's programs, step by step. Files in `folder`: database.db, models/.
struct Mapping {
  const std::vector<ListedView>& views;
  std::filesystem::path pictures, folder;
  const SfmOptions& options;
  Colmap& colmap;
  Progress& progress;

  std::filesystem::path database() const { return folder / "database.db"; }
  std::filesystem::path database_note() const { return folder / "database.json"; }  // what it was made of
};

// SIFT features of all pictures. A database of the same pictures and options is gone on with (COLMAP skips
// what it holds, but for matches: NormalizeDatabase), any other is replaced. Throws Error if COLMAP did not
// read every picture or found nothing in any.
void ExtractFeatures(const Mapping& mapping);

// Matches pictures: "exhaustive" (all pairs) or "sequential" (neighbours in the order of names, and ever
// farther ones).
void MatchFeatures(const Mapping& mapping, const std::string& matcher);

// One run of the mapper. focal_factor: where it starts from if nothing is known of the focal length, times
// the larger side of the picture (1.2 is COLMAP's own guess). lenient: lower thresholds. least: pictures of a
// model that is kept (10 is COLMAP's own number; with fewer a bad start of a good set is kept as well).
struct MappingAttempt {
  std::string name;
  double focal_factor = 1.2;
  bool lenient = false;
  int least = 10;
};

// Runs the mapper into models/NAME and returns its models (ReadModels), one of each part of the pictures that
// hangs together.
std::vector<SparseModel> MapViews(const Mapping& mapping, const MappingAttempt& attempt);

// The models in the folder's subfolders, that with most registered views, then most points, first. A damaged
// one is skipped with a warning.
std::vector<SparseModel> ReadModels(const std::filesystem::path& models, Progress& progress);

// The first one; an empty model if there is none.
SparseModel BestOf(const std::vector<SparseModel>& models);

// Points for known poses: COLMAP's point_triangulator on the database's matches. limit_px: reprojection error
// of a point that is kept; 4 is COLMAP's own.
SparseModel TriangulatePoints(const Mapping& mapping, const SparseModel& known, double limit_px = 4);

// What COLMAP found out about the views, for messages.
std::map<std::string, DatabaseImage> ReadDatabase(const Mapping& mapping);

}  // namespace polarscan
