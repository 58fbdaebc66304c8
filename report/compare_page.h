// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "evaluation/evaluate_scan.h"
#include "evaluation/output/plots.h"

namespace polarscan {

// Writes one self-contained HTML page that compares scans with the same truth: the figures side by side
// (evaluation/output/table.h), the curves, and each view's error pictures. pictures: those of each evaluation,
// in the same order. Throws Error if the page cannot be written.
void WriteComparison(const std::filesystem::path& html, const std::string& truth,
                     const std::vector<NamedEvaluation>& evaluations,
                     const std::vector<std::vector<ErrorPictures>>& pictures);

}  // namespace polarscan
