// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/image.h"
#include "demosaic/stokes.h"

namespace polarscan {

// What a picture's edges are looked for in: the root of the light, and of the polarized light S1 and S2 as much as
// noise is alike in all three; of the picture's brightest, 1.
class LightSteps {
 public:
  explicit LightSteps(const StokesImage& light);

  int width() const { return planes_[0].width(); }
  int height() const { return planes_[0].height(); }
  // How unlike the light on both sides of a point is, along a unit direction: of means over `reach` pixels. 0 where the
  // picture ends.
  double Across(const Eigen::Vector2d& at, const Eigen::Vector2d& direction, int reach) const;
  // How unlike two pixels are.
  double Between(int x, int y, int other_x, int other_y) const;

 private:
  std::array<Image<float>, 3> planes_;
};

// Distance to the outline of a mask, which runs between pixels, in px at pixel centres: negative inside, positive outside.
Image<float> SignedDistance(const Image<std::uint8_t>& mask);

// A place of a mask's outline, with the direction out of the mask.
struct OutlinePlace {
  Eigen::Vector2d at, out;
};
// Up to `most` places of the outline, spread over it, none nearer to the picture's border than `clear_px`.
std::vector<OutlinePlace> OutlinePlaces(const Image<std::uint8_t>& mask, int most, double clear_px);

// Where along the normal of each place the largest step of the light lies, px: negative is inside of the mask. At most
// reach_px away.
std::vector<float> StepOffsets(const LightSteps& light, const std::vector<OutlinePlace>& places,
                               int reach_px);

// The largest step of the light within kStepAround px of a place, along its normal.
inline constexpr int kStepAround = 2;
double StepAround(const LightSteps& light, const OutlinePlace& place);

// How far outside of the masks' outlines the pictures' edges lie, in px, where most of the offsets say so: their mode, at
// least kSystematic away from 0; else 0.
double SystematicOffset(const std::vector<float>& offsets, int reach_px);

}  // namespace polarscan
