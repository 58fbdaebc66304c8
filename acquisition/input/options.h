// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/input/input.h"

namespace polarscan {

// The options with what they leave open taken from FOLDER/set.json, if there is one:
//   {"input_kind": "mosaic", "gamma": 1, "aop_sense": "clockwise", "aop_scale": "degrees",
//    "angles": "0,60,120",
//    "sensor": {"layout": "90 45 / 135 0 (any remark)", "bits": 12, "black_dn": 60, "white_dn": 4000,
//               "max_dn": 4095, "full_well_e": 10500, "dn_per_e": 0.375, "read_noise_e": 2.5,
//               "calibration": "../camera-17 (a folder, as seen from here)"},
//    "camera": {"vendor": "", "model": "", "serial": "17"}, "settings": {"Gain": 0}}
// All keys are optional and others are ignored. Without white_dn the smaller of max_dn and the full well
// counts. What is still open then is taken from "sensor" in FOLDER/session.json, which has the same keys.
InputOptions WithSetJson(InputOptions options, const std::filesystem::path& folder);

// Keys of FOLDER/set.json that are nearly one of those above, in words.
std::vector<std::string> MisspelledKeys(const std::filesystem::path& folder);

// The same from "sensor" alone, which `where` holds.
InputOptions WithSensorJson(InputOptions options, const nlohmann::json& sensor,
                            const std::filesystem::path& where);

// The calibration that the options (then the folder) name; null: none.
std::shared_ptr<const Calibration> FindCalibration(const InputOptions& options,
                                                   const std::filesystem::path& folder);

// What its camera's noise is goes before what the folder says, after what the options say.
InputOptions WithCalibratedNoise(InputOptions options, const Calibration* calibration);
// What is still open.
InputOptions WithCalibratedSensor(InputOptions options, const Calibration* calibration);

// By which camera and how the pictures in the folder were taken: session.json's or set.json's "camera" and
// "settings".
CameraBinding BindingOf(const Input& input);

}  // namespace polarscan
