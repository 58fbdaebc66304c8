// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "demosaic/sensor/sensor.h"
#include "demosaic/stokes.h"

namespace polarscan {

// Standard deviation of an intensity sample as a function of its level (both in units of full scale):
// variance = at_zero + per_level * level. Read noise and rounding are the first term, shot noise the second.
struct NoiseModel {
  double at_zero = 0, per_level = 0;

  // Never 0: below float32's own rounding there is nothing to tell.
  float Sigma(float level) const;
};

// From the sensor's gain and read noise. Needs sensor.dn_per_e > 0 and gamma 1.
NoiseModel SensorNoise(const Sensor& sensor);

// From the picture itself, for sources of unknown gain. In blocks of 16 px the larger of two robust levels
// counts, because each is blind to something:
//   redundancy I0 + I90 - I45 - I135 (sd 2 sigma): sees no noise that the four angles share, as in rendered
//   sets.
//     Polarizers of unequal gain show in it. Up to 1 % of S0 that counts, for it makes S1 and S2 wrong just as
//     noise does; what is more, and the same share everywhere, is left out: stereo corrects it by the shape
//     (pipeline/stereo/corrections/polarization_fit.h);
//   mixed second differences of S1 and S2 (sd sqrt(72) sigma): see no noise that is smooth, as in compressed
//   pictures.
// Blocks are sorted by brightness into bins, whose quiet tenth tells the noise without the
// texture. Then the model is fitted to the bins. image.noise must be infinite at invalid pixels, which do not
// count, and finite elsewhere. redundancy: of each pixel, or empty where the source has none. lag: distance
// in pixels at which the noise of two pixels is independent, 1 if nothing was interpolated. With fewer than 4
// usable blocks the model is zero.
NoiseModel EstimateNoise(const StokesImage& image, const Image<float>& redundancy, int lag);

}  // namespace polarscan
