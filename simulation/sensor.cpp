// SPDX-License-Identifier: Apache-2.0
#include "simulation/sensor.h"

#include <algorithm>
#include <cmath>

namespace polarscan {

int SimulatedSensor::black_dn() const { return int(std::lround(black_share * max_dn())); }

double SimulatedSensor::dn_per_e() const {
  const double white = std::round(max_dn() * 4000.0 / 4095.0);
  return (white - black_dn()) / full_well_e;
}

double Poisson(double mean, Random& random) {
  if (mean <= 0) return 0;
  if (mean > 30) return std::max(0.0, std::round(mean + std::sqrt(mean) * random.Normal()));
  const double limit = std::exp(-mean);
  double product = random.Uniform();
  int count = 0;
  for (; product > limit; ++count) product *= random.Uniform();
  return count;
}

std::uint16_t SimulatedSensor::Count(double signal, Random& random) const {
  double electrons = std::max(0.0, signal) * full_well_e;
  if (noise) electrons = Poisson(electrons, random) + read_noise_e * random.Normal();
  const double dn = black_dn() + dn_per_e() * std::min(electrons, full_well_e);
  return std::uint16_t(std::clamp(std::round(dn), 0.0, double(max_dn())));
}

}  // namespace polarscan
