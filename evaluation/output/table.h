// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "evaluation/result.h"

namespace polarscan {

// What `polarscan evaluate` found as a table for people.
std::string EvaluationTable(const Evaluation& evaluation);

// Several of them side by side, in the layout of the paper's table 1: points, accuracy and completeness in
// hundredths of the unit, then F, depth and normal errors.
std::string ComparisonTable(const std::vector<NamedEvaluation>& evaluations);

// The same as rows of texts: [label, one text a scan].
std::vector<std::vector<std::string>> ComparisonRows(const std::vector<NamedEvaluation>& evaluations);

}  // namespace polarscan
