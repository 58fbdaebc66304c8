// SPDX-License-Identifier: Apache-2.0
#include "evaluation/thresholds.h"

#include <algorithm>
#include <sstream>

#include "core/error.h"

namespace polarscan {

std::vector<double> ParseThresholds(const std::string& text, double unit) {
  std::string spaced = text;
  std::ranges::replace(spaced, ',', ' ');
  std::istringstream in(spaced);
  std::vector<double> thresholds;
  for (double value; in >> value;) thresholds.push_back(value * unit);
  const bool positive = std::ranges::all_of(thresholds, [](double t) { return t > 0; });
  if (!in.eof() || thresholds.empty() || !positive)
    throw Error("not a list of positive thresholds", "'" + text + "'", "Write them as 0.005,0.01,0.02");
  return thresholds;
}

}  // namespace polarscan
