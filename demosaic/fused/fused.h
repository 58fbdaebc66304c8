// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <span>
#include <string>

#include "demosaic/sensor/pixel_format.h"
#include "demosaic/sensor/sensor.h"

namespace polarscan {

// What a mono polarization mosaic says, pixel by pixel (demosaic/stokes.h). dop in 0 ... , 0 where S0 <= 0;
// aop in [0, pi) radians.
struct PolarPlanes {
  Image<float> s0, s1, s2, dop, aop;
};

// From a camera's bytes to S0, S1, S2, DoP, AoP in one pass, for live use: bands of rows go through
// unpacking, demosaicing and Stokes while they are in the cache, on TBB's threads, with vector instructions
// chosen at run time. Methods: bilinear (alias preview), difference, linear; mono sensors with gamma 1.
//
// The siblings to compare with are Unpack, ToLight and the functions of method.h: S0, S1, S2 differ from
// theirs by no more than 4e-6 of full scale (sums are ordered differently), AoP from the C library's by 2e-5
// rad (polynomial of Abramowitz, Stegun 4.4.49), DoP by 1e-6 of itself.
class FusedDemosaic {
 public:
  // Throws Error on a method or sensor that it is not for, or a size under 4x4.
  FusedDemosaic(const std::string& method, const Sensor& sensor, const PixelFormat& format, int width,
                int height);
  ~FusedDemosaic();

  // `planes` are made if they are not of the frame's size; keep them for the next frame. angles: dop and aop
  // too. stride as in Unpack. Throws Error if the bytes are too few.
  void operator()(std::span<const std::uint8_t> bytes, PolarPlanes& planes, bool angles,
                  std::size_t stride = 0);

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace polarscan
