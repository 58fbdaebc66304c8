// SPDX-License-Identifier: Apache-2.0
#include "demosaic/stokes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/error.h"
#include "core/formats/image_io.h"

namespace polarscan {
namespace {

constexpr float kAopTableEnd = 8;  // degree / noise: beyond it the simple law is right to 1 %
constexpr std::size_t kAopTableSteps = 128;

// Density of an angle's error for this ratio of true degree and noise; error in (-pi/2, pi/2).
double AopDensity(double error_rad, double ratio) {
  const double eta = ratio / std::numbers::sqrt2 * std::cos(2 * error_rad);
  const double root_pi = std::sqrt(std::numbers::pi);
  return (std::exp(-ratio * ratio / 2) / root_pi +
          eta * std::exp(eta * eta - ratio * ratio / 2) * (1 + std::erf(eta))) /
         root_pi;
}

// Standard deviation by Simpson's rule.
double AopNoise(double ratio) {
  constexpr int kSteps = 512;
  const double step = std::numbers::pi / 2 / kSteps;
  double sum = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double weight = i == 0 || i == kSteps ? 1 : i % 2 ? 4 : 2;
    sum += weight * (i * step) * (i * step) * AopDensity(i * step, ratio);
  }
  return std::sqrt(2 * sum * step / 3);
}

std::array<float, kAopTableSteps + 1> AopNoiseTable() {
  std::array<float, kAopTableSteps + 1> table{};
  for (std::size_t i = 0; i <= kAopTableSteps; ++i)
    table[i] = float(AopNoise(double(i) * kAopTableEnd / kAopTableSteps));
  return table;
}

}  // namespace

void Correct(const PolarizationCorrection& correction, StokesImage& image) {
  if (correction == PolarizationCorrection()) return;
  const double turn = 2 * correction.turn_deg * std::numbers::pi / 180;
  const float cosine = float(std::cos(turn)), sine = float(std::sin(turn)),
              sign = correction.mirrored ? -1.0f : 1.0f;
  for (std::size_t i = 0; i < image.s0.size(); ++i) {
    const float s0 = image.s0.pixels()[i];
    float& s1 = image.s1.pixels()[i];
    float& s2 = image.s2.pixels()[i];
    const float a = s1 - float(correction.bias_s1) * s0, b = sign * (s2 - float(correction.bias_s2) * s0);
    s1 = cosine * a - sine * b;
    s2 = sine * a + cosine * b;
  }
}

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

float DebiasedDegreeOfPolarization(float degree, float sigma) {
  if (degree <= 0) return 0;
  if (!(sigma > 0)) return degree;
  const float ratio = degree / sigma;
  return degree - sigma / (2 * ratio) * -std::expm1(-ratio * ratio);
}

float AngleOfPolarizationNoise(float degree, float sigma) {
  static const std::array<float, kAopTableSteps + 1> table = AopNoiseTable();
  if (!(sigma > 0)) return 0;
  const float ratio = std::max(0.0f, degree / sigma);
  if (!(ratio < kAopTableEnd)) return 1 / (2 * ratio);
  const float at = ratio * float(kAopTableSteps) / kAopTableEnd;
  const auto below = std::size_t(at);
  const float share = at - float(below);
  return (1 - share) * table[below] + share * table[below + 1];
}

void AverageNoise(StokesImage& image, double pixels) {
  const double polarization = 1 + (pixels - 1) * image.independence;
  const double intensity = 1 + (pixels - 1) * image.independence * image.s0_noise * image.s0_noise;
  for (float& noise : image.noise.pixels()) noise /= float(std::sqrt(polarization));
  image.independence *= pixels / polarization;
  image.s0_noise *= std::sqrt(polarization / intensity);
}

void WriteStokes(const std::filesystem::path& path, const StokesImage& image) {
  const bool plain = image.s0_noise == 1 && image.independence == 1;
  const nlohmann::json noise = {{"s0_noise", image.s0_noise}, {"independence", image.independence}};
  WriteFloatTiff(path, {&image.s0, &image.s1, &image.s2, &image.noise}, plain ? "" : noise.dump());
}

StokesImage ReadStokes(const std::filesystem::path& path) {
  std::string description;
  std::vector<Image<float>> pages = ReadFloatTiff(path, &description);
  if (pages.size() != 4)
    throw Error(
        "a Stokes view has four pages (S0, S1, S2, noise), this file has " + std::to_string(pages.size()),
        path.string());
  StokesImage image{std::move(pages[0]), std::move(pages[1]), std::move(pages[2]), std::move(pages[3])};
  const nlohmann::json noise = nlohmann::json::parse(description, nullptr, false);
  if (!noise.is_object()) return image;  // somebody else's words
  for (auto [key, value] : {std::pair{"s0_noise", &image.s0_noise}, {"independence", &image.independence}}) {
    if (!noise.contains(key) || !noise[key].is_number()) continue;
    *value = noise[key].get<double>();
    if (!(*value > 0 && *value < 100))
      throw Error("the TIFF file's description of its noise is damaged", path.string());
  }
  return image;
}

}  // namespace polarscan
