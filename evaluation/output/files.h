// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "evaluation/evaluate.h"

namespace polarscan {

// What `polarscan evaluate` leaves in a scan, for the report and for people:
//   evaluation.json                   the result (docs/evaluate.md), with the cloud's hash
//   cloud_errors.ply                  x y z error: distance of each point of the cloud, in its order, to the
//                                     true surface, in the truth's units; positions in the truth's frame
//   depth/ normal/                    NAME.png: errors of that view's maps
//   depth.svg normals.svg cloud.svg   curves
inline std::filesystem::path EvaluationFolder(const std::filesystem::path& scan) {
  return scan / "evaluation";
}
inline std::filesystem::path EvaluationJsonPath(const std::filesystem::path& evaluation) {
  return evaluation / "evaluation.json";
}
inline std::filesystem::path CloudErrorsPath(const std::filesystem::path& evaluation) {
  return evaluation / "cloud_errors.ply";
}
inline std::filesystem::path DepthErrorPath(const std::filesystem::path& evaluation,
                                            const std::string& view) {
  return evaluation / "depth" / (view + ".png");
}
inline std::filesystem::path NormalErrorPath(const std::filesystem::path& evaluation,
                                             const std::string& view) {
  return evaluation / "normal" / (view + ".png");
}

// Leaves them: the folder is made anew; without evaluation.json, which comes last, it counts as none.
class EvaluationFiles {
 public:
  explicit EvaluationFiles(const std::filesystem::path& scan);
  void AddView(const std::string& view, const ErrorMaps& errors, const ErrorLimits& limits);
  void AddCloud(const std::vector<Eigen::Vector3d>& points, const std::vector<double>& errors);
  void Finish(const Evaluation& evaluation);

 private:
  std::filesystem::path folder_;
};

}  // namespace polarscan
