// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "demosaic/calibration/binding.h"
#include "demosaic/sensor/lit_mosaic.h"

namespace polarscan {

// What is known about one camera, set in one way. A folder:
//   calibration.json   the binding, the sensor's numbers, a summary of each part and the checksums
//   maps-HASH.tif      float32 pages, one value a pixel: black_dn; a0, a1, a2
//                      (demosaic/calibration/response.h)
// Beside them pictures for people, which nobody reads back (demosaic/calibration/pictures.h). The JSON file
// is replaced last, so that the folder always holds one whole calibration.
struct Calibration {
  CameraBinding binding;
  Sensor sensor;  // layout, bits, white level; mean black level; dn_per_e 0, read_noise_e 0: not known
  MosaicCorrection correction;
  nlohmann::json parts = nlohmann::json::object();  // "dark", "flat", "polarizer": how each came about
  std::string hash = {};  // of all of it; set by reading and writing, as is the next one
  std::filesystem::path folder = {};
};

bool IsCalibration(const std::filesystem::path& folder);

// Sets calibration.hash and folder. Atomic; maps of an earlier calibration in the folder are removed after
// it.
void WriteCalibration(const std::filesystem::path& folder, Calibration& calibration);

// Throws Error if it is no calibration, damaged, changed by hand, or by a newer program.
Calibration ReadCalibration(const std::filesystem::path& folder);

}  // namespace polarscan
