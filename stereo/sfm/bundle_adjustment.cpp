// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/bundle_adjustment.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/files.h"
#include "core/similarity.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

constexpr double kLoosePx = 16;  // error of a point that is kept while the poses are only nearly right
constexpr double kTightPx = 4;   // COLMAP's own limit

SparseModel Adjusted(const Mapping& m, const SparseModel& model) {
  const fs::path input = m.folder / "models" / "unadjusted", output = m.folder / "models" / "adjusted" / "0";
  fs::remove_all(output);
  CreateFolder(output);
  WriteSparseModelText(input, model);
  m.colmap.Run("bundle_adjuster",
               {{{"input_path"}, input, true},
                {{"output_path"}, output, true},
                {{"BundleAdjustment.refine_focal_length"}, "0", true},
                {{"BundleAdjustment.refine_principal_point"}, "0"},
                {{"BundleAdjustment.refine_extra_params"}, "0", true}},
               "bundle adjustment", 0, "");
  return BestModel(output.parent_path(), m.progress);
}

std::vector<Eigen::Vector3d> Centers(const SparseModel& model) {
  std::vector<Eigen::Vector3d> centers;
  for (const auto& [id, image] : model.images) centers.push_back(image.cam_from_world.Center());
  return centers;
}

// Images have the same ids in both.
SparseModel Moved(SparseModel model, const SparseModel& known) {
  Similarity similarity;
  try {
    similarity = EstimateSimilarity(Centers(model), Centers(known));
  } catch (const Error&) {
    return model;
  }
  for (auto& [id, image] : model.images) image.cam_from_world = similarity(image.cam_from_world);
  for (auto& [id, point] : model.points) point.position = similarity * point.position;
  return model;
}

}  // namespace

SparseModel AdjustKnownPoses(const Mapping& m, const SparseModel& known) {
  SparseModel model = known;
  for (const double limit_px : {kLoosePx, kTightPx}) {
    model = TriangulatePoints(m, model, limit_px);
    if (model.images.size() == known.images.size() && !model.points.empty()) model = Adjusted(m, model);
    if (model.images.size() == known.images.size() && !model.points.empty()) continue;
    m.progress.Warn("COLMAP could not adjust the poses: they are taken as they were given");
    return known;
  }
  SparseModel given;  // with the ids of the database
  for (const auto& [id, image] : model.images)
    for (const auto& [known_id, known_image] : known.images)
      if (known_image.name == image.name) given.images[id] = known_image;
  model = Moved(std::move(model), given);
  double sum = 0, most = 0;
  for (const auto& [id, image] : model.images) {
    const double moved = (image.cam_from_world.Center() - given.images.at(id).cam_from_world.Center()).norm();
    sum += moved, most = std::max(most, moved);
  }
  m.progress.Info(
      fmt::format("bundle adjustment of {} points moved the cameras by {:.2g} on average, {:.2g} at most",
                  model.points.size(), sum / double(model.images.size()), most));
  return model;
}

}  // namespace polarscan
