// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <string>
#include <vector>

#include "core/formats/image_io.h"
#include "demosaic/method.h"
#include "demosaic/sensor/lit_mosaic.h"
#include "demosaic/sensor/sensor.h"
#include "demosaic/stokes.h"

namespace polarscan {

// One view, whatever it was made from: its polarization and, where the source has colour, S0 of red, green,
// blue. Invalid pixels (clipped samples and what depends on them) have infinite noise; S0, S1, S2 are finite
// there too.
struct PolarView {
  StokesImage stokes;
  std::vector<Image<float>> colour_s0;  // empty or three
  Image<float> redundancy;              // I0 + I90 - I45 - I135; empty where the source has no four angles
};

// Throws Error if a mosaic cannot be what the sensor says: sides that are not whole cells (2x2 px, colour
// 4x4), counts that the sensor's bits cannot hold, or no sample that is not clipped. where: the view's name.
void CheckMosaic(const Image<float>& counts, const Sensor& sensor, const std::string& where);

// From one raw mosaic, counts as stored. The noise of a sample is the mosaic's own or the sensor's where
// its gain is known; else it is estimated from the bilinear view, whatever the method, and scaled by the
// method's gain. A clipped sample alone in its cell is recovered from the other
// three, and its surroundings get kRecoveredNoise times the noise; more than one make theirs invalid.
PolarView ViewFromMosaic(const Image<float>& counts, const Sensor& sensor, const DemosaicMethod& method,
                         const MosaicCorrection& correction = {});

// From light behind ideal polarizers.
PolarView ViewFromLight(const LitMosaic& mosaic, const Sensor& sensor, const DemosaicMethod& method);

// From pictures behind polarizers at 0, 45, 90, 135 degrees, grey or colour, all of one size.
PolarView ViewFromAngles(const std::array<const Picture*, 4>& pictures, const Sensor& sensor);

// From pictures behind a polarizer at three or more other angles, in degrees, by least squares. Where a
// sample is clipped the pixel is invalid. Of unevenly spread angles `noise` is what makes sd(S1) and sd(S2)
// right in the mean of their squares. Throws Error if the angles do not tell S0, S1 and S2.
PolarView ViewFromPolarizer(const std::vector<Picture>& pictures, const std::vector<double>& angles_deg,
                            const Sensor& sensor);

// From S0, S1, S2 as floating-point pictures, grey or colour. noise: of each pixel, or null to estimate it.
PolarView ViewFromStokes(const std::array<const Picture*, 3>& pictures, const Image<float>* noise);

// From intensity (grey or colour, S0 = 2 x light), angle (radians, anticlockwise) and degree of polarization.
PolarView ViewFromAopDop(const Picture& intensity, const Image<float>& aop_rad, const Image<float>& dop,
                         const Sensor& sensor);

// From a photo without polarization: S1 = S2 = 0. Clipped pixels stay valid: nothing here depends on ratios.
PolarView ViewFromPhoto(const Picture& picture, const Sensor& sensor);

// Changes the sense of the angle of polarization, for sources that count clockwise.
void Mirror(PolarView& view);

}  // namespace polarscan
