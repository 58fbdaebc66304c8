// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <array>

#include "core/image.h"
#include "demosaic/stokes.h"

namespace polarscan {

// Pictures for people: how polarization, depth and normals look as 8-bit colour. Never an input of a later
// stage.

// What a pixel without a value looks like: a neutral dark grey that none of the maps below produces.
inline constexpr Rgb8 kNoData{38, 40, 44};

// 256 colours from low to high, luminance rising all the way (readable in grey and by colour-blind people).
// Heat: black, purple, orange, pale yellow (matplotlib's "inferno"). Ramp: purple, green, yellow ("viridis").
// Both CC0.
using Palette = std::array<Rgb8, 256>;
Palette HeatPalette();
Palette RampPalette();
// The palette's colour at t in [0, 1]; clamped.
Rgb8 ColourAt(const Palette& palette, float t);

// Cyclic maps of the angle of polarization, AoP in radians, any turn, anticlockwise as displayed from +x
// (docs/conventions.md); strength in [0, 1]: black where there is no polarization.
// kHsv: hue = 2 AoP (red at 0 and 180 degrees, yellow-green at 45, cyan at 90, violet at 135), value =
// strength. kEven: the hue of OKLab (Ottosson 2020) turns by 2 AoP at lightness 0.74 and chroma 0.12, so that
// equal steps of AoP look equally far apart and no angle looks brighter than another.
enum class AopMap { kHsv, kEven };
Rgb8 AopColour(float aop_rad, float strength = 1, AopMap map = AopMap::kHsv);

// dop_full is the degree of polarization shown at full strength (the strength of the AoP picture is the
// square root of DoP / dop_full: weak polarization still shows its angle). kNoData where noise is infinite or
// S0 <= 0.
Image<Rgb8> AopPicture(const StokesImage& view, float dop_full = 1, AopMap map = AopMap::kHsv);
// Every angle at full strength, however weak the polarization.
Image<Rgb8> AngleOnlyPicture(const StokesImage& view);
Image<Rgb8> DopPicture(const StokesImage& view, float dop_full = 1);

// Grey, 255 (value / s0_full)^(1/2.2): S0; the least light behind a turning polarizer, 2 Imin = S0 - |(S1,
// S2)|, what a diffuse surface sends; the light that it takes away, 2 (Imax - Imin) = 2 |(S1, S2)|, what
// mirrors. Twice the light, so that one s0_full serves all.
Image<Rgb8> S0Picture(const StokesImage& view, float s0_full);
Image<Rgb8> DiffusePicture(const StokesImage& view, float s0_full);
Image<Rgb8> SpecularPicture(const StokesImage& view, float s0_full);

// |I0 + I90 - I45 - I135| as heat, full at sd_full times its own noise, 2 view.noise: bright where
// interpolation, motion or calibration failed.
Image<Rgb8> RedundancyPicture(const StokesImage& view, const Image<float>& redundancy, float sd_full = 5);

// Near is yellow, far is purple; kNoData where depth is 0. near_depth < far_depth, same unit as depth.
Image<Rgb8> DepthPicture(const Image<float>& depth, float near_depth, float far_depth);

// Camera-frame normals (x right, y down, z forward): red grows to the right, green upwards, blue towards the
// camera, so a surface that faces the camera is light blue. kNoData where the normal is zero.
Rgb8 NormalColour(const Eigen::Vector3f& normal);
Image<Rgb8> NormalPicture(const Image<Eigen::Vector3f>& normal);

// Legends, size_px wide and high, kNoData outside of the disc. The wheel shows at each place the colour of
// that direction's AoP, with strength = distance from the centre; the ball is a sphere coloured by its
// normals.
Image<Rgb8> AopWheel(int size_px, AopMap map = AopMap::kHsv);
Image<Rgb8> NormalBall(int size_px);

// Puts a legend into the bottom right corner, where it fits; its kNoData shows the picture.
void DrawLegend(const Image<Rgb8>& legend, Image<Rgb8>& picture);

// Full scale of a legend for degrees of polarization: the 98 % quantile, rounded up to twentieths, 0.1 to 1.
double DopFullScale(const std::vector<double>& dop);

}  // namespace polarscan
