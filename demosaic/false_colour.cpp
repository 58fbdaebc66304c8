// SPDX-License-Identifier: Apache-2.0
#include "demosaic/false_colour.h"

#include "core/statistics.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace polarscan {
namespace {

constexpr std::array<std::uint32_t, 10> kInferno = {0x000004, 0x1b0c41, 0x4a0c6b, 0x781c6d, 0xa52c60,
                                                    0xcf4446, 0xed6925, 0xfb9b06, 0xf7d13d, 0xfcffa4};
constexpr std::array<std::uint32_t, 10> kViridis = {0x440154, 0x482878, 0x3e4989, 0x31688e, 0x26828e,
                                                    0x1f9e89, 0x35b779, 0x6ece58, 0xb5de2b, 0xfde725};

// The largest chroma that sRGB has for every hue at this lightness; the hue of red.
constexpr float kEvenLightness = 0.74f, kEvenChroma = 0.12f, kEvenRed = 0.5f;

std::uint8_t ToByte(float value) { return std::uint8_t(std::lround(255 * std::clamp(value, 0.f, 1.f))); }

// Linear between equally spaced 0xRRGGBB stops.
Palette Interpolate(const std::array<std::uint32_t, 10>& stops) {
  Palette palette;
  for (int i = 0; i < 256; ++i) {
    const float t = float(i) / 255 * float(stops.size() - 1);
    const std::size_t k = std::min(std::size_t(t), stops.size() - 2);
    const auto channel = [&](int shift) {
      const float a = float((stops[k] >> shift) & 255), b = float((stops[k + 1] >> shift) & 255);
      return ToByte((a + (b - a) * (t - float(k))) / 255);
    };
    palette[std::size_t(i)] = {channel(16), channel(8), channel(0)};
  }
  return palette;
}

bool HasValue(const StokesImage& view, int x, int y) {
  return view.s0(x, y) > 0 && (view.noise.empty() || std::isfinite(view.noise(x, y)));
}

// Brightness of a share of the full degree of polarization: the root, so that weak polarization still shows
// its angle.
float Strength(float share) { return std::sqrt(std::min(share, 1.f)); }

// The picture of width x height whose pixel (x, y) is colour(x, y).
Image<Rgb8> Paint(int width, int height, const std::function<Rgb8(int, int)>& colour) {
  Image<Rgb8> picture(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) picture(x, y) = colour(x, y);
  return picture;
}

// Paints a disc: colour(u, v) of the place in the unit circle, u right, v up.
Image<Rgb8> PaintDisc(int size_px, const std::function<Rgb8(float, float)>& colour) {
  return Paint(size_px, size_px, [&](int x, int y) {
    const float u = (float(x) + 0.5f) / float(size_px) * 2 - 1,
                v = 1 - (float(y) + 0.5f) / float(size_px) * 2;
    return u * u + v * v <= 1 ? colour(u, v) : kNoData;
  });
}

// Grey of value(S0, |(S1, S2)|) with the eye's gamma.
Image<Rgb8> PaintGrey(const StokesImage& view, float s0_full,
                      const std::function<float(float, float)>& value) {
  return Paint(view.s0.width(), view.s0.height(), [&](int x, int y) {
    if (!HasValue(view, x, y)) return kNoData;
    const float light = value(view.s0(x, y), std::hypot(view.s1(x, y), view.s2(x, y))) / s0_full;
    const std::uint8_t grey = ToByte(std::pow(std::max(light, 0.f), 1 / 2.2f));
    return Rgb8{grey, grey, grey};
  });
}

Rgb8 HsvColour(float aop_rad, float strength) {
  const float turns = aop_rad / std::numbers::pi_v<float>;
  const float sector = 6 * (turns - std::floor(turns));  // hue in sixths of the circle
  const auto channel = [&](float centre) {  // full within one sixth of its centre, none beyond two
    const float apart = std::abs(sector - centre), distance = std::min(apart, 6 - apart);
    return ToByte(strength * std::clamp(2 - distance, 0.f, 1.f));
  };
  return {channel(0), channel(2), channel(4)};
}

// sRGB's curve on linear light.
std::uint8_t ToSrgb(float light) {
  return ToByte(light <= 0.0031308f ? 12.92f * light : 1.055f * std::pow(light, 1 / 2.4f) - 0.055f);
}

// OKLab to sRGB with the matrices of B. Ottosson, A perceptual color space for image processing (2020).
Rgb8 EvenColour(float aop_rad, float strength) {
  const float hue = 2 * aop_rad + kEvenRed, lightness = kEvenLightness * strength;
  const float a = kEvenChroma * strength * std::cos(hue), b = kEvenChroma * strength * std::sin(hue);
  const auto cube = [](float x) { return x * x * x; };
  const float l = cube(lightness + 0.3963377774f * a + 0.2158037573f * b),
              m = cube(lightness - 0.1055613458f * a - 0.0638541728f * b),
              s = cube(lightness - 0.0894841775f * a - 1.2914855480f * b);
  return {ToSrgb(4.0767416621f * l - 3.3077115913f * m + 0.2309699292f * s),
          ToSrgb(-1.2684380046f * l + 2.6097574011f * m - 0.3413193965f * s),
          ToSrgb(-0.0041960863f * l - 0.7034186147f * m + 1.7076147010f * s)};
}

}  // namespace

Palette HeatPalette() { return Interpolate(kInferno); }
Palette RampPalette() { return Interpolate(kViridis); }

Rgb8 ColourAt(const Palette& palette, float t) { return palette[ToByte(t)]; }

Rgb8 AopColour(float aop_rad, float strength, AopMap map) {
  return map == AopMap::kHsv ? HsvColour(aop_rad, strength) : EvenColour(aop_rad, strength);
}

Image<Rgb8> AopPicture(const StokesImage& view, float dop_full, AopMap map) {
  return Paint(view.s0.width(), view.s0.height(), [&](int x, int y) {
    if (!HasValue(view, x, y)) return kNoData;
    const float s1 = view.s1(x, y), s2 = view.s2(x, y);
    return AopColour(std::atan2(s2, s1) / 2, Strength(std::hypot(s1, s2) / view.s0(x, y) / dop_full), map);
  });
}

Image<Rgb8> AngleOnlyPicture(const StokesImage& view) {
  return Paint(view.s0.width(), view.s0.height(), [&](int x, int y) {
    return HasValue(view, x, y) ? AopColour(std::atan2(view.s2(x, y), view.s1(x, y)) / 2) : kNoData;
  });
}

Image<Rgb8> S0Picture(const StokesImage& view, float s0_full) {
  return PaintGrey(view, s0_full, [](float s0, float) { return s0; });
}

Image<Rgb8> DiffusePicture(const StokesImage& view, float s0_full) {
  return PaintGrey(view, s0_full, [](float s0, float polarized) { return s0 - polarized; });
}

Image<Rgb8> SpecularPicture(const StokesImage& view, float s0_full) {
  return PaintGrey(view, s0_full, [](float, float polarized) { return 2 * polarized; });
}

Image<Rgb8> RedundancyPicture(const StokesImage& view, const Image<float>& redundancy, float sd_full) {
  const Palette heat = HeatPalette();
  return Paint(view.s0.width(), view.s0.height(), [&](int x, int y) {
    if (!HasValue(view, x, y)) return kNoData;
    return ColourAt(heat, std::abs(redundancy(x, y)) / (2 * view.noise(x, y) * sd_full));
  });
}

Image<Rgb8> DopPicture(const StokesImage& view, float dop_full) {
  const Palette heat = HeatPalette();
  return Paint(view.s0.width(), view.s0.height(), [&](int x, int y) {
    if (!HasValue(view, x, y)) return kNoData;
    return ColourAt(heat, std::hypot(view.s1(x, y), view.s2(x, y)) / view.s0(x, y) / dop_full);
  });
}

Image<Rgb8> DepthPicture(const Image<float>& depth, float near_depth, float far_depth) {
  const Palette ramp = RampPalette();
  return Paint(depth.width(), depth.height(), [&](int x, int y) {
    const float z = depth(x, y);
    return z > 0 ? ColourAt(ramp, (far_depth - z) / (far_depth - near_depth)) : kNoData;
  });
}

Rgb8 NormalColour(const Eigen::Vector3f& normal) {
  if (normal.isZero()) return kNoData;
  return {ToByte((1 + normal.x()) / 2), ToByte((1 - normal.y()) / 2), ToByte((1 - normal.z()) / 2)};
}

Image<Rgb8> NormalPicture(const Image<Eigen::Vector3f>& normal) {
  return Paint(normal.width(), normal.height(), [&](int x, int y) { return NormalColour(normal(x, y)); });
}

Image<Rgb8> AopWheel(int size_px, AopMap map) {
  return PaintDisc(size_px, [map](float u, float v) {
    return AopColour(std::atan2(v, u), Strength(std::hypot(u, v)), map);
  });
}

void DrawLegend(const Image<Rgb8>& legend, Image<Rgb8>& picture) {
  const int left = picture.width() - legend.width(), top = picture.height() - legend.height();
  for (int y = std::max(0, -top); y < legend.height(); ++y)
    for (int x = std::max(0, -left); x < legend.width(); ++x)
      if (!(legend(x, y) == kNoData)) picture(left + x, top + y) = legend(x, y);
}

Image<Rgb8> NormalBall(int size_px) {
  return PaintDisc(size_px, [](float u, float v) {
    return NormalColour({u, -v, -std::sqrt(std::max(0.f, 1 - u * u - v * v))});
  });
}

double DopFullScale(const std::vector<double>& dop) {
  return std::clamp(std::ceil(Quantile(dop, 0.98) * 20) / 20, 0.1, 1.0);
}

}  // namespace polarscan
