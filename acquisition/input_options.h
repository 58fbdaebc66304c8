// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/input.h"

namespace polarscan {

// The options with what they leave open taken from FOLDER/set.json, if there is one:
//   {"input_kind": "mosaic", "gamma": 1, "aop_sense": "clockwise", "aop_scale": "degrees",
//    "sensor": {"layout": "90 45 / 135 0 (any remark)", "bits": 12, "black_dn": 60, "white_dn": 4000,
//               "max_dn": 4095, "full_well_e": 10500, "dn_per_e": 0.375, "read_noise_e": 2.5}}
// All keys are optional and others are ignored. Without white_dn the smaller of max_dn and the full well
// counts. What is still open then is taken from "sensor" in FOLDER/session.json, which has the same keys.
InputOptions WithSetJson(InputOptions options, const std::filesystem::path& folder);

}  // namespace polarscan
