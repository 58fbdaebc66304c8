// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/image.h"

namespace polarscan {

// Weighted normalised cross-correlation between a reference patch and its image under a homography, eqs. (3),
// (4).

constexpr int kMaxTaps = 448;  // radius 10, step 1, rounded up to the widest vector

// Where the samples of a matching window lie around its centre, pixels. Padded to a multiple of 16 with zero
// offsets.
struct Window {
  int taps = 0, padded = 0, radius = 0;
  alignas(64) float dx[kMaxTaps] = {}, dy[kMaxTaps] = {};
};
// A square of that radius, or without the samples near its corners (farther than 1.2 radii from the centre):
// radius 5, step 2 then has 32 samples, a multiple of every vector's length.
Window MakeWindow(int radius, int step, bool corners = true);

// A reference patch with everything that does not depend on the hypothesis. Intensities are relative to the
// centre pixel. weight: bilateral, sum 1, zero on padding and on background; weighted: weight * intensity.
struct Patch {
  alignas(64) float weight[kMaxTaps];
  alignas(64) float weighted[kMaxTaps];
  float center = 0, mean = 0, variance = 0;
};

// Bilateral weights exp(-(dx^2+dy^2) / (2 radius^2) - dI^2 / (2 sigma_color^2)) by table, grey in [0, 1].
class PatchReader {
 public:
  PatchReader(const Window& window, double sigma_color);
  // mask: samples where it is 0 do not count (may be empty). (x, y) must lie in the image; samples outside do
  // not count.
  void Read(const Image<float>& gray, const Image<std::uint8_t>& mask, int x, int y, Patch& patch) const;

 private:
  const Window& window_;
  std::vector<float> spatial_, range_;
};

// A source picture as the kernel reads it: word x of a row holds pixel x in its low and pixel x + 1 in its
// high 16 bits (65535 = 1.0), so that one load serves two neighbours.
struct PackedImage {
  int width = 0, height = 0;
  std::vector<std::uint32_t> words;
};
PackedImage Pack(const Image<float>& gray);

// The homography around the reference pixel: a sample at offset (dx, dy) falls on the source's continuous
// image point ((u0 + ux dx + uy dy) / w, (v0 + vx dx + vy dy) / w) with w = w0 + wx dx + wy dy.
struct Warp {
  float u0, ux, uy, v0, vx, vy, w0, wx, wy;
};

// What patches with little contrast cost. Variances are of grey in [0, 1].
struct Contrast {
  float epsilon = 0;  // added to both variances and to the covariance, so that flat matches flat
  float min_reference = 0, min_source = 0;  // a patch of less variance costs 2
};

// 1 - NCC of patches with these variances and covariance.
inline float NccCostOf(float reference, float source, float covariance, const Contrast& contrast) {
  constexpr float kRounding = 1e-7f;  // of the sums: less is no contrast
  if (reference < contrast.min_reference || source < contrast.min_source) return 2;
  const float r = reference + contrast.epsilon, s = source + contrast.epsilon;
  if (r < kRounding || s < kRounding) return 2;
  const float cost = 1 - (covariance + contrast.epsilon) / std::sqrt(r * s);
  return std::clamp(cost, 0.0f, 2.0f);
}

// 1 - NCC in [0, 2]; 2 if any sample is behind the source camera, if the centre falls outside of its picture,
// or if nothing varies and epsilon is 0. Samples outside are taken from the border.
float NccCostScalar(const Window&, const Patch&, const Warp&, const PackedImage&, const Contrast&);

// The same by vectors of the widest kind that this processor has (Highway, run-time dispatch); equal to the
// scalar one but for the order of the sums.
float NccCostSimd(const Window&, const Patch&, const Warp&, const PackedImage&, const Contrast&);

}  // namespace polarscan
