// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "demosaic/calibration/flat.h"

namespace polarscan {

// Collects differences of pairs of frames by polarizer angle and level.
class TransferSums {
 public:
  explicit TransferSums(const Sensor& sensor);
  // Two frames of the same light as counts.
  void AddPair(const Image<float>& a, const Image<float>& b, const Image<float>& black_dn);
  // Behind 0, 45, 90, 135 degrees (0 ... 3). Levels with few samples, or so bright that some are clipped,
  // are left out; rounding is taken off.
  std::vector<TransferPoint> Points(std::size_t angle) const;

 private:
  static constexpr std::size_t kBins = 24;
  struct Bin {
    double level = 0, difference = 0, squares = 0, samples = 0;
  };
  void AddRow(int y, const Image<float>& a, const Image<float>& b, const Image<float>& black_dn, double ratio,
              std::array<std::array<Bin, kBins>, 4>& bins) const;

  const Sensor& sensor_;
  std::array<std::array<Bin, kBins>, 4> bins_{};
};

// Least squares, weighted by the points' own uncertainty; the read noise is fixed where it is known (>= 0).
// Throws Error if the points do not span a factor of 2 in level, or are fewer than 2 (1 with known read
// noise).
PhotonTransfer FitTransfer(const std::vector<TransferPoint>& points, double read_noise_dn);

}  // namespace polarscan
