// SPDX-License-Identifier: Apache-2.0
#include "stereo/costs/stereo_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/parallel.h"

namespace polarscan {
namespace {

// g of eq. (9): rises to 1 at rho_0 and stays there.
float DopWeight(float dop, float rho0) {
  const float missing = std::min(dop, rho0) - rho0;
  return 1 - missing * missing / (rho0 * rho0);
}

// 1 / (1 + (sigma_phi / limit)^2) with the AoP's standard deviation sigma_phi = noise / (sqrt(2) |(S1, S2)|).
float NoiseWeight(float noise, float polarized, float limit_rad) {
  const float sigma = noise / (std::numbers::sqrt2_v<float> * limit_rad);
  return polarized > 0 ? polarized * polarized / (polarized * polarized + sigma * sigma) : 0;
}

// Variance of S0 over 5x5 pixels against its noise, or the weight of the AoP, whichever is more; inside the
// mask.
Image<float> MakeEvidence(const StokesImage& stokes, const Image<PolarSample>& polar,
                          const Image<std::uint8_t>& mask) {
  constexpr int kReach = 2;
  constexpr float kNoise = 2;  // texture of so many standard deviations counts half
  const int width = stokes.s0.width(), height = stokes.s0.height();
  Image<float> evidence(width, height);
  ParallelFor(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const float noise = float(stokes.s0_noise) * stokes.noise(x, y);
      if (!std::isfinite(noise) || (!mask.empty() && !mask(x, y))) continue;
      float sum = 0, squares = 0, count = 0;
      for (int v = std::max(0, y - kReach); v <= std::min(height - 1, y + kReach); ++v)
        for (int u = std::max(0, x - kReach); u <= std::min(width - 1, x + kReach); ++u) {
          const float away = stokes.s0(u, v) - stokes.s0(x, y);
          sum += away, squares += away * away, ++count;
        }
      const float variance = std::max(0.0f, squares / count - sum * sum / (count * count));
      const float texture = variance / (variance + kNoise * kNoise * noise * noise + 1e-12f);
      evidence(x, y) = polar.empty() ? texture : std::max(texture, polar(x, y).weight);
    }
  });
  return evidence;
}

Image<float> Half(const Image<float>& image) {
  Image<float> half(image.width() / 2, image.height() / 2);
  ParallelFor(0, half.height(), [&](int y) {
    for (int x = 0; x < half.width(); ++x)
      half(x, y) = (image(2 * x, 2 * y) + image(2 * x + 1, 2 * y) + image(2 * x, 2 * y + 1) +
                    image(2 * x + 1, 2 * y + 1)) /
                   4;
  });
  return half;
}

StokesImage Half(const StokesImage& image) {
  StokesImage half{Half(image.s0),    Half(image.s1), Half(image.s2),
                   Half(image.noise), image.s0_noise, image.independence};
  AverageNoise(half, 4);
  return half;
}

Image<std::uint8_t> HalfMask(const Image<std::uint8_t>& mask) {
  Image<std::uint8_t> half(mask.width() / 2, mask.height() / 2);
  for (int y = 0; y < half.height(); ++y)
    for (int x = 0; x < half.width(); ++x)
      half(x, y) =
          mask(2 * x, 2 * y) | mask(2 * x + 1, 2 * y) | mask(2 * x, 2 * y + 1) | mask(2 * x + 1, 2 * y + 1);
  return half;
}

}  // namespace

Image<float> MakeGray(const Image<float>& s0, float scale) {
  Image<float> gray(s0.width(), s0.height());
  ParallelFor(0, s0.height(), [&](int y) {
    for (int x = 0; x < s0.width(); ++x)
      gray(x, y) = std::pow(std::clamp(s0(x, y) * scale, 0.0f, 1.0f), 1 / 2.2f);
  });
  return gray;
}

Image<PolarSample> MakePolarSamples(const StokesImage& stokes, const StereoOptions& options) {
  Image<PolarSample> samples(stokes.s0.width(), stokes.s0.height());
  const bool by_noise = options.polarization_evidence == "noise";
  const float limit_rad = float(options.aop_noise_deg * std::numbers::pi / 180);
  ParallelFor(0, samples.height(), [&](int y) {
    for (int x = 0; x < samples.width(); ++x) {
      const float s1 = stokes.s1(x, y), s2 = stokes.s2(x, y), noise = stokes.noise(x, y);
      PolarSample& sample = samples(x, y);
      if (!std::isfinite(noise)) continue;
      const float phi = AngleOfPolarization(s1, s2);
      sample.cos_phi = std::cos(phi), sample.sin_phi = std::sin(phi);
      sample.dop = DegreeOfPolarization(stokes.s0(x, y), s1, s2);
      sample.weight = by_noise ? NoiseWeight(noise, std::hypot(s1, s2), limit_rad)
                               : DopWeight(sample.dop, float(options.dop_saturation));
    }
  });
  return samples;
}

Pinhole HalfCamera(const Pinhole& c) {
  return {c.width / 2, c.height / 2, c.fx / 2, c.fy / 2, c.cx / 2, c.cy / 2};
}

StereoView MakeStereoView(const Pinhole& camera, const Rigid& cam_from_world, StokesImage stokes,
                          bool polarized, Image<std::uint8_t> mask, float gray_scale,
                          const StereoOptions& options, int halvings) {
  StereoView view;
  view.camera = camera;
  view.cam_from_world = cam_from_world;
  view.mask = std::move(mask);
  for (int i = 0; i < halvings; ++i) {
    stokes = Half(stokes);
    view.camera = HalfCamera(view.camera);
    if (!view.mask.empty()) view.mask = HalfMask(view.mask);
  }
  view.gray = MakeGray(stokes.s0, gray_scale);
  view.packed = Pack(view.gray);
  if (polarized && options.polarization) view.polar = MakePolarSamples(stokes, options);
  view.evidence = MakeEvidence(stokes, view.polar, view.mask);
  if (options.silhouettes && !view.mask.empty())
    view.silhouette = Dilate(view.mask, options.silhouette_margin_px);
  view.whole_silhouette = !view.silhouette.empty() && KeepsClearOfBorder(view.silhouette);
  return view;
}

bool KeepsClearOfBorder(const Image<std::uint8_t>& mask) {
  for (int x = 0; x < mask.width(); ++x)
    if (mask(x, 0) || mask(x, mask.height() - 1)) return false;
  for (int y = 0; y < mask.height(); ++y)
    if (mask(0, y) || mask(mask.width() - 1, y)) return false;
  return true;
}

Image<std::uint8_t> Dilate(const Image<std::uint8_t>& mask, double radius) {
  const int reach = int(std::ceil(radius));
  Image<std::uint8_t> wide = mask;
  const auto widen = [&](int x, int y) {
    for (int dy = -reach; dy <= reach; ++dy)
      for (int dx = -reach; dx <= reach; ++dx)
        if (dx * dx + dy * dy <= (radius + 0.5) * (radius + 0.5) && wide.Contains(x + dx, y + dy))
          wide(x + dx, y + dy) = 255;
  };
  const auto is_set = [&](int x, int y) { return !mask.Contains(x, y) || mask(x, y); };
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x)
      if (mask(x, y) && !(is_set(x - 1, y) && is_set(x + 1, y) && is_set(x, y - 1) && is_set(x, y + 1)))
        widen(x, y);  // from the inside of an object nothing outside of it is nearest
  return wide;
}

}  // namespace polarscan
