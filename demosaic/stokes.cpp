// SPDX-License-Identifier: Apache-2.0
#include "demosaic/stokes.h"

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/image_io.h"

namespace polarscan {

float AngleOfPolarization(float s1, float s2) {
  constexpr float kPi = std::numbers::pi_v<float>;
  const float angle = 0.5f * std::atan2(s2, s1);
  const float turned = angle < 0 ? angle + kPi : angle;
  return turned < kPi ? turned : 0.0f;  // -tiny + pi rounds to pi
}

float DegreeOfPolarization(float s0, float s1, float s2) {
  return s0 > 0 ? std::sqrt(s1 * s1 + s2 * s2) / s0 : 0.0f;
}

float DegreeOfPolarizationNoise(float s0, float sigma) { return std::numbers::sqrt2_v<float> * sigma / s0; }

void WriteStokes(const std::filesystem::path& path, const StokesImage& image) {
  WriteFloatTiff(path, {&image.s0, &image.s1, &image.s2, &image.noise});
}

StokesImage ReadStokes(const std::filesystem::path& path) {
  std::vector<Image<float>> pages = ReadFloatTiff(path);
  if (pages.size() != 4)
    throw Error(
        "a Stokes view has four pages (S0, S1, S2, noise), this file has " + std::to_string(pages.size()),
        path.string());
  return {std::move(pages[0]), std::move(pages[1]), std::move(pages[2]), std::move(pages[3])};
}

}  // namespace polarscan
