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

// The cyclic map of the angle of polarization: HSV with hue = 2 AoP (red at 0 and 180 degrees, yellow-green
// at 45, cyan at 90, violet at 135), value = strength in [0, 1]: black where there is no polarization. AoP in
// radians, any turn, anticlockwise as displayed from +x (docs/conventions.md).
Rgb8 AopColour(float aop_rad, float strength = 1);

// dop_full is the degree of polarization shown at full strength (the strength of the AoP picture is the
// square root of DoP / dop_full: weak polarization still shows its angle). kNoData where noise is infinite or
// S0 <= 0.
Image<Rgb8> AopPicture(const StokesImage& view, float dop_full = 1);
Image<Rgb8> DopPicture(const StokesImage& view, float dop_full = 1);

// Near is yellow, far is purple; kNoData where depth is 0. near_depth < far_depth, same unit as depth.
Image<Rgb8> DepthPicture(const Image<float>& depth, float near_depth, float far_depth);

// Camera-frame normals (x right, y down, z forward): red grows to the right, green upwards, blue towards the
// camera, so a surface that faces the camera is light blue. kNoData where the normal is zero.
Rgb8 NormalColour(const Eigen::Vector3f& normal);
Image<Rgb8> NormalPicture(const Image<Eigen::Vector3f>& normal);

// Legends, size_px wide and high, kNoData outside of the disc. The wheel shows at each place the colour of
// that direction's AoP, with strength = distance from the centre; the ball is a sphere coloured by its
// normals.
Image<Rgb8> AopWheel(int size_px);
Image<Rgb8> NormalBall(int size_px);

}  // namespace polarscan
