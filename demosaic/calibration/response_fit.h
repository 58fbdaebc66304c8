// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "demosaic/calibration/response.h"

namespace polarscan {

// The responses of all pixels, with how well they fit.
struct FittedResponses {
  ResponseMap responses;  // defect: clipped in a frame, or nothing like a polarizer
  // Of each pixel: standard deviation of its readings from the fit, in light, weighted as they are;
  // infinite where clipped.
  Image<float> residual;
  std::size_t clipped = 0, defect = 0;  // pixels; clipped ones are among the defect ones
};

// Fits each pixel's response to known light by weighted least squares. Frames come one by one, so that
// memory does not grow with their number: 4 floats a pixel.
class ResponseFit {
 public:
  ResponseFit(int width, int height, const Layout& layout);

  // readings: light, black subtracted. clipped: 1 where a sample carries no information. weights: what
  // readings of pixels at 0, 45, 90 and 135 degrees count; their inverse variances, up to a factor that all
  // frames share.
  void Add(const Image<float>& readings, const Image<std::uint8_t>& clipped, const Eigen::Vector3d& stokes,
           const Eigen::Vector4d& weights);
  // Throws Error after fewer than 4 frames.
  FittedResponses Solve() const;

 private:
  Layout layout_;
  int frames_ = 0;
  std::array<Eigen::Matrix3d, 4> normals_;             // of each angle's pixels
  Eigen::Vector4d weights_ = Eigen::Vector4d::Zero();  // their sums
  Image<float> r0_, r1_, r2_, squares_;  // weighted sums of reading x S0, S1, S2 and of reading^2
  Image<std::uint8_t> clipped_;
};

// Whose mean gain becomes 1, in each colour. Neighbourhoods are 32x32 px: uneven light and the lens's shading
// then do not end up in the responses.
enum class GainReference {
  kPicture,
  kNeighbourhood,
  kNeighbourhoodOfAngle,  // of pixels behind the same polarizer angle: for light that may be polarized
};
void NormalizeGains(ResponseMap& responses, const Layout& layout, GainReference reference);

// Marks what is nothing like a polarizer: normalized gain outside 0.5 ... 1.5, diattenuation below 0.5 or
// above 1.3, turned by more than 15 degrees. Returns how many there are now.
std::size_t MarkDefects(ResponseMap& responses, const Layout& layout);

}  // namespace polarscan
