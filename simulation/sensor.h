// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

#include "core/random.h"
#include "demosaic/sensor/layout.h"

namespace polarscan {

// A polarization sensor. Defaults resemble Sony's IMX250MZR (12 bit, 3.45 um).
struct SimulatedSensor {
  Layout layout;
  int bits = 12;                     // 8 to 16; counts lie in the low bits of 16-bit pictures
  double full_well_e = 10500;        // electrons at which a pixel saturates
  double read_noise_e = 2.5;         // standard deviation
  double black_share = 60.0 / 4095;  // black level as a share of the largest count
  bool noise = true;

  int max_dn() const { return (1 << bits) - 1; }
  int black_dn() const;
  // Counts per electron; the full well lands at 4000/4095 of the range, as on the camera.
  double dn_per_e() const;

  // The count of a pixel whose mean signal is `signal` full wells: Poisson electrons, normal read noise,
  // saturation, black level, rounding. Variance in the linear range: dn_per_e^2 (electrons + read_noise_e^2)
  // + 1/12.
  std::uint16_t Count(double signal, Random& random) const;
};

// Poisson-distributed number: exact (Knuth) below 30, rounded normal above, where skewness is under 0.2.
double Poisson(double mean, Random& random);

}  // namespace polarscan
