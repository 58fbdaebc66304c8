// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <span>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/options.h"
#include "demosaic/sensor/layout.h"

namespace polarscan {

inline constexpr std::array<int, 4> kAnglesDeg = {0, 45, 90, 135};

// The light behind each polarizer, in the order of kAnglesDeg, all four on the same pixel grid.
using AnglePlanes = std::array<Image<float>, 4>;

// A demosaicing method: a new one is a row in method.cpp and a file with its function.
struct DemosaicMethod {
  std::string name;
  std::string help;
  // From one light sample a pixel (linear, black subtracted) to full-size planes: one set for mono sensors,
  // three (red, green, blue) for colour sensors.
  std::vector<AnglePlanes> (*interpolate)(const Image<float>& samples, const Layout& layout);
  // How far in pixels (along x and y) from a pixel the samples lie that its value depends on by more than a
  // fiftieth of their change: one clipped sample spoils the pixels within. Exact for linear methods.
  int reach_mono = 0, reach_colour = 0;
  // Root mean square over the pixels of sd(S1), sd(S2) / (sqrt(2) sd(sample)) for independent noise on even
  // light; colour: of the mean over colours. S0 keeps more of it: s0_noise_mono is sd(S0) / sd(sample).
  double noise_mono = 1, noise_colour = 1, s0_noise_mono = 1, s0_noise_colour = 1;

  int Reach(const Layout& layout) const { return layout.bayer.empty() ? reach_mono : reach_colour; }
  double NoiseGain(const Layout& layout) const { return layout.bayer.empty() ? noise_mono : noise_colour; }
  double S0NoiseGain(const Layout& layout) const {
    return layout.bayer.empty() ? s0_noise_mono : s0_noise_colour;
  }
};

std::span<const DemosaicMethod> DemosaicMethods();

// Throws Error naming the methods there are.
const DemosaicMethod& FindDemosaicMethod(const std::string& name);

struct DemosaicOptions {
  std::string method = "eari";  // why: docs/demosaic.md, "Which one"
};
OptionTable Table(DemosaicOptions& options);

}  // namespace polarscan
