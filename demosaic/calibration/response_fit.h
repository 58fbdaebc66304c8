// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <cstddef>

#include "demosaic/calibration/response.h"

namespace polarscan {

// The responses of all pixels, with how well they fit.
struct FittedResponses {
  ResponseMap responses;  // defect: clipped in a frame, or nothing like a polarizer
  // Of each pixel: standard deviation of its readings from the fit, in light; infinite where clipped.
  Image<float> residual;
  std::size_t clipped = 0, defect = 0;  // pixels; clipped ones are among the defect ones
};

// Fits each pixel's response to known light by least squares. Frames come one by one, so that memory does
// not grow with their number: 4 floats a pixel.
class ResponseFit {
 public:
  ResponseFit(int width, int height);

  // readings: light, black subtracted. clipped: 1 where a sample carries no information.
  void Add(const Image<float>& readings, const Image<std::uint8_t>& clipped, const Eigen::Vector3d& stokes);
  // Throws Error after fewer than 4 frames.
  FittedResponses Solve() const;

 private:
  int frames_ = 0;
  Eigen::Matrix3d normal_ = Eigen::Matrix3d::Zero();
  Image<float> r0_, r1_, r2_, squares_;  // sums of reading x S0, S1, S2 and of reading^2
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
