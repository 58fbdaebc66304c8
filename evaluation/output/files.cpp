// SPDX-License-Identifier: Apache-2.0
#include "evaluation/output/files.h"

#include <algorithm>
#include <set>

#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "evaluation/output/pictures.h"
#include "evaluation/output/plots.h"
#include "fusion/cloud/cloud.h"

namespace fs = std::filesystem;

namespace polarscan {
namespace {

bool HoldsOnlyOurs(const fs::path& folder) {
  static const std::set<std::string> kNames = {"evaluation.json", "cloud_errors.ply", "depth",    "normal",
                                               "depth.svg",       "normals.svg",      "cloud.svg"};
  return std::ranges::all_of(fs::directory_iterator(folder), [](const fs::directory_entry& entry) {
    const std::string name = entry.path().filename().string();
    return name.starts_with('.') || kNames.contains(name);
  });
}

}  // namespace

EvaluationFiles::EvaluationFiles(const fs::path& scan) : folder_(EvaluationFolder(scan)) {
  RequireFree(
      folder_, [&] { return HoldsOnlyOurs(folder_); }, "Move away what is not an evaluation's");
  fs::remove_all(folder_);
  CreateFolder(folder_);
}

void EvaluationFiles::AddView(const std::string& view, const ErrorMaps& errors, const ErrorLimits& limits) {
  WritePng(DepthErrorPath(folder_, view), ErrorPicture(errors.depth, limits.depth));
  if (!errors.normal_deg.empty())
    WritePng(NormalErrorPath(folder_, view), ErrorPicture(errors.normal_deg, limits.normal_deg));
}

void EvaluationFiles::AddCloud(const std::vector<Eigen::Vector3d>& points,
                               const std::vector<double>& errors) {
  WriteCloudErrors(CloudErrorsPath(folder_), points, errors);
}

void EvaluationFiles::Finish(const Evaluation& evaluation) {
  for (const CurveDrawing& drawing : DrawCurves({{"", evaluation}}))
    WriteFileAtomically(folder_ / (drawing.key + ".svg"), drawing.svg);
  WriteJson(EvaluationJsonPath(folder_), ToJson(evaluation));
}

}  // namespace polarscan
