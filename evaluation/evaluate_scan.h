// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/progress.h"
#include "evaluation/evaluate.h"

namespace polarscan {

// What evaluate's command line says.
struct EvaluateArguments {
  std::vector<std::filesystem::path> inputs;  // scans, dense workspaces, clouds
  std::filesystem::path truth, poses, cloud, html;
  std::vector<std::filesystem::path> surroundings;
  bool align = true, maps = true, keep = true;
  EvaluateOptions options;
  std::uint64_t seed = 0;
  Eigen::Vector3d truth_origin = Eigen::Vector3d::Zero();  // from where the Truth's coordinates count
};

// Errors of one view as pictures for a page.
struct ErrorPictures {
  std::string view;
  Image<Rgb8> depth, normal;  // normal: empty if the view has none
};

struct Evaluated {
  Evaluation result;
  std::vector<ErrorPictures> pictures;
  std::filesystem::path kept;  // the scan's folder evaluation/, if the result was left there
};

// Compares one input with the truth. A scan keeps the result in its folder evaluation/
// (evaluation/output/files.h) unless arguments.keep is false; where it cannot be written to, that is a warning.
// Pictures are made, at most `picture_px` wide and high, if that is above 0.
Evaluated EvaluateInput(const std::filesystem::path& input, const EvaluateArguments& arguments,
                        const Truth& truth, int picture_px, Progress& progress);

}  // namespace polarscan
