// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "evaluation/result.h"

namespace polarscan {

// One drawing of cumulative errors (the paper's figure 3: x an error, y the share of what has a smaller one),
// a curve a scan.
struct CurveDrawing {
  std::string key;  // "depth", "normals", "cloud"
  std::string svg;  // with its own colours for curves; text and axes in currentColor
};

// Those that the evaluations have figures for. In the cloud's drawing accuracy is solid, completeness dashed.
std::vector<CurveDrawing> DrawCurves(const std::vector<NamedEvaluation>& evaluations);

// The colour of the scan at that place, "#rrggbb".
std::string SeriesColour(std::size_t index);

}  // namespace polarscan
