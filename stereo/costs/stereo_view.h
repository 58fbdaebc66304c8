// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/camera.h"
#include "core/image.h"
#include "demosaic/stokes.h"
#include "stereo/costs/ncc.h"
#include "stereo/options.h"

namespace polarscan {

// The AoP phi of one pixel as its cosine and sine, how much it counts (g of eq. (9), or the noise-aware
// weight), and the DoP. 16 bytes.
struct PolarSample {
  float cos_phi = 1, sin_phi = 0, weight = 0, dop = 0;
};

// One view as the matcher needs it. Grey is S0 in [0, 1] after gamma 1/2.2, one scale for the whole set.
struct StereoView {
  Pinhole camera;
  Rigid cam_from_world;
  Image<float> gray;
  PackedImage packed;
  Image<PolarSample> polar;        // empty if the set is not polarized
  Image<float> evidence;           // 0 to 1: how far the pixel's surroundings say anything, by texture or AoP
  Image<std::uint8_t> mask;        // 255 = object; empty: everything
  Image<std::uint8_t> silhouette;  // the mask widened by the margin; empty: no mask
  bool whole_silhouette =
      false;  // it keeps clear of the border: nothing of the object lies outside of the picture
};

// Depth (z, 0 = none) and unit normal (camera frame, facing the camera) of every pixel.
struct DepthNormalMap {
  Image<float> depth;
  Image<Eigen::Vector3f> normal;
};

// S0 as grey values, 0 to 1, with a gamma of 2.2; and a view's polarization. Sizes as the picture's.
Image<float> MakeGray(const Image<float>& s0, float scale);
Image<PolarSample> MakePolarSamples(const StokesImage& stokes, const StereoOptions& options);

// The view from its light and mask (empty: none), their sizes halved so often: means of 2x2 pixels (an odd
// last row or column is left out); a pixel is invalid if one of the four is, and in the mask if one of the
// four is. gray_scale: what S0 is multiplied by.
StereoView MakeStereoView(const Pinhole& camera, const Rigid& cam_from_world, StokesImage stokes,
                          bool polarized, Image<std::uint8_t> mask, float gray_scale,
                          const StereoOptions& options, int halvings = 0);

Pinhole HalfCamera(const Pinhole& camera);

// Whether no pixel of the picture's border is set.
bool KeepsClearOfBorder(const Image<std::uint8_t>& mask);

// Each pixel of `mask` that has a set pixel within `radius` (rounded box) becomes set.
Image<std::uint8_t> Dilate(const Image<std::uint8_t>& mask, double radius);

}  // namespace polarscan
