// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/progress.h"
#include "demosaic/calibration/frames.h"
#include "demosaic/calibration/response.h"
#include "demosaic/sensor/sensor.h"

namespace polarscan {

// Variance of samples that have this level, both over black; DN and DN^2.
struct TransferPoint {
  double level_dn, variance_dn2;
  std::size_t samples;
};

// The line variance = dn_per_e level + read_dn^2 through photon transfer points.
struct PhotonTransfer {
  double dn_per_e = 0, read_noise_dn = 0;
};

// What frames of even light at several levels tell.
struct FlatCalibration {
  std::vector<TransferPoint> points;
  PhotonTransfer all;
  std::array<PhotonTransfer, 4> by_angle{};  // 0, 45, 90, 135 degrees
  std::array<double, 4> gain_by_angle{};     // over their mean; of unpolarized light these are the sensor's
  ResponseMap responses;                     // gains of the pixels, otherwise ideal
  double gain_spread = 0;                    // true standard deviation of the pixels' gains behind one angle
  int frames = 0, pairs = 0;
};

struct FlatOptions {
  // The light is known to be unpolarized (an integrating sphere): what differs between the four polarizers is
  // then their gain. Else only what differs between pixels behind the same one.
  bool unpolarized = false;
};

// Photon transfer from differences of two frames of the same light, in which the pixels' own gains and uneven
// light cancel: frames that follow each other and agree in their mean to 3 % are such a pair. Samples are
// sorted by their level (Janesick, Photon Transfer, 2007). black_dn: of each pixel, or empty.
// read_noise_dn: known from dark frames, or negative. Throws Error: fewer than 2 frames, no pairs, clipped or
// dark frames, too few levels to see the slope.
FlatCalibration CalibrateFlat(const CalibrationFrames& frames, const Sensor& sensor,
                              const Image<float>& black_dn, double read_noise_dn, const FlatOptions& options,
                              Progress& progress);

nlohmann::json Summary(const FlatCalibration& flat, const Sensor& sensor);

}  // namespace polarscan
