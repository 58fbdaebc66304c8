// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

namespace polarscan {

// "0.001,0.002" or "5 10 20" as numbers, each times `unit`. Throws Error on anything else.
std::vector<double> ParseThresholds(const std::string& text, double unit);

}  // namespace polarscan
