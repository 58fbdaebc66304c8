// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/colmap/bundle_adjustment.h"

#include <fmt/format.h>

#include "core/error.h"
#include "core/files/files.h"
#include "stereo/sfm/alignment.h"

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
  return BestOf(ReadModels(output.parent_path(), m.progress));
}

}  // namespace

SparseModel AdjustKnownPoses(const Mapping& m, const SparseModel& known) {
  SparseModel model = known;
  const auto is_whole = [&] { return model.images.size() == known.images.size() && !model.points.empty(); };
  for (const double limit_px : {kLoosePx, kTightPx}) {
    model = TriangulatePoints(m, model, limit_px);
    if (is_whole()) model = Adjusted(m, model);
    if (is_whole()) continue;
    m.progress.Warn("COLMAP could not adjust the poses: they are taken as they were given");
    return known;
  }
  try {
    const Alignment moved = AlignCameras(Poses(model), Poses(known));
    for (auto& [id, image] : model.images) image.cam_from_world = moved.truth_from_scan(image.cam_from_world);
    for (auto& [id, point] : model.points) point.position = moved.truth_from_scan * point.position;
    m.progress.Info(
        fmt::format("bundle adjustment of {} points moved the cameras by {:.2g} rms, {:.2g} at most",
                    model.points.size(), moved.errors.rms, moved.errors.max));
  } catch (const Error&) {  // on one line, or fewer than three: they stay where COLMAP left them
    m.progress.Info(fmt::format("bundle adjustment of {} points", model.points.size()));
  }
  return model;
}

}  // namespace polarscan
