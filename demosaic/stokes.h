// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "core/image.h"

namespace polarscan {

// Linear polarization of one view: S0, S1, S2 on the same pixel grid, linear in light, in units of the
// sensor's full scale (one full-scale sample is 1, so S0 of an unpolarized saturated pixel is 2). Convention:
// S0 = (I0+I45+I90+I135)/2, S1 = I0 - I90, S2 = I45 - I135, angles anticlockwise as displayed from +x
// (docs/conventions.md). Colour sources: the mean over the colour channels.
// noise: standard deviation of one intensity sample I at that pixel, in the same units; then sd(S1) = sd(S2)
// = sqrt(2) noise. Infinity marks an invalid pixel (clipped, outside of the lens's picture).
struct StokesImage {
  Image<float> s0, s1, s2, noise;
  // sd(S0) / noise: 1 for four samples at one place; demosaicing may keep more of it in S0.
  double s0_noise = 1;
  // What another pixel adds to a mean of many, as a share of what a pixel says by itself: 1 if the pixels'
  // noise is independent, less where neighbours share samples (a mosaic has one sample a pixel, not four).
  double independence = 1;
};

// What is wrong with all pictures of a set, and how to mend it: S1 and S2 less `bias` times S0 (gains of the four
// angles that differ), S2 negated if mirrored (angles counted the other way), then both turned.
struct PolarizationCorrection {
  double turn_deg = 0;  // of the angle of polarization, anticlockwise
  bool mirrored = false;
  double bias_s1 = 0, bias_s2 = 0;  // shares of S0

  bool operator==(const PolarizationCorrection&) const = default;
};
void Correct(const PolarizationCorrection& correction, StokesImage& image);

// noise, s0_noise and independence of means over `pixels` neighbours; they are those of one pixel before. The
// variance is that of 1 + (pixels - 1) independence pixels: right to 22 % for every demosaicing method
// (superpixel: 30 %).
void AverageNoise(StokesImage& image, double pixels);

// Angle of polarization in [0, pi) radians; where there is no polarization the value is arbitrary.
float AngleOfPolarization(float s1, float s2);

// sqrt(S1^2 + S2^2) / S0, 0 where S0 <= 0.
float DegreeOfPolarization(float s0, float s1, float s2);

// Standard deviation of the degree of polarization for equal noise `sigma` in the four samples: sqrt(2) sigma
// / S0. S0's own noise is left out: it adds (degree sd(S0) / S0)^2 to the variance.
float DegreeOfPolarizationNoise(float s0, float sigma);

// The measured degree is too high where there is noise: it is never negative. Less its bias, smooth, above 0
// and right in the mean to 3 % where it is more than twice its noise (MAS estimator: Plaszczynski et al.,
// MNRAS 439:4048, 2014): p - sigma^2 / (2 p) (1 - exp(-p^2 / sigma^2)). sigma: of the degree, as above.
float DebiasedDegreeOfPolarization(float degree, float sigma);

// Standard deviation of the angle of polarization in radians, where the true degree is `degree` and its noise
// `sigma`: sigma / (2 degree) where that is small, pi / sqrt(12) (every angle alike) without polarization; in
// between by the angle's exact distribution (Naghizadeh-Khouei and Clarke, A&A 274:968, 1993).
float AngleOfPolarizationNoise(float degree, float sigma);

// A Stokes view file: a TIFF with four float32 pages S0, S1, S2, noise; s0_noise and independence in its
// description, as JSON, where they are not 1.
void WriteStokes(const std::filesystem::path& path, const StokesImage& image);
StokesImage ReadStokes(const std::filesystem::path& path);

}  // namespace polarscan
