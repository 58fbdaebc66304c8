// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json.hpp>
#include <string>

namespace polarscan {

// What `polarscan evaluate` found (its JSON) as a table for people.
std::string EvaluationTable(const nlohmann::json& evaluation);

}  // namespace polarscan
