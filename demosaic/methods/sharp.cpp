// SPDX-License-Identifier: Apache-2.0
#include "demosaic/methods/sharp.h"

#include <algorithm>
#include <functional>

#include "core/parallel.h"
#include "demosaic/bayer.h"
#include "demosaic/methods/guide.h"
#include "demosaic/methods/residual.h"

namespace polarscan {
namespace {

// The sum of all 49 taps.
float Gain(const LinearKernels::Kernel& kernel) {
  float gain = 0;
  for (std::size_t i = 0; i < 16; ++i) gain += kernel[i] * float((i % 4 ? 2 : 1) * (i / 4 ? 2 : 1));
  return gain;
}

// S0 plus the kernels' answer to what 2 M and the neighbours' S0 differ from it.
Image<float> Sharpen(const Image<float>& samples, const Image<float>& s0, const LinearKernels& kernels) {
  const Image<float> from_mosaic = Convolve(samples, kernels.sharpen_mosaic),
                     from_s0 = Convolve(s0, kernels.sharpen_s0);
  const float own = 1 - Gain(kernels.sharpen_mosaic) - Gain(kernels.sharpen_s0);
  Image<float> sharp(s0.width(), s0.height());
  ParallelFor(0, s0.height(), [&](int y) {
    for (int x = 0; x < s0.width(); ++x) sharp(x, y) = own * s0(x, y) + 2 * from_mosaic(x, y) + from_s0(x, y);
  });
  return sharp;
}

Image<float> Halved(Image<float> image) {
  for (float& value : image.pixels()) value /= 2;
  return image;
}

}  // namespace

Image<float> MeanS0(const AnglePlanes& planes) {
  Image<float> s0(planes[0].width(), planes[0].height());
  ParallelFor(0, s0.height(), [&](int y) {
    for (int x = 0; x < s0.width(); ++x)
      s0(x, y) = (planes[0](x, y) + planes[1](x, y) + planes[2](x, y) + planes[3](x, y)) / 2;
  });
  return s0;
}

AnglePlanes FillSharp(const Image<float>& samples, const Layout& layout, const LinearKernels& kernels) {
  const AnglePlanes first = FillAnglesByResidual(samples, layout, EdgeAwareGuide(samples));
  const Image<float> s0 = Sharpen(samples, MeanS0(first), kernels);
  AnglePlanes second = FillAnglesByResidual(samples, layout, Halved(s0));
  const Image<float> second_s0 = MeanS0(second);
  ParallelFor(0, samples.height(), [&](int y) {
    for (int x = 0; x < samples.width(); ++x) {
      float mean[4], sum = 0;
      for (std::size_t a = 0; a < 4; ++a) sum += mean[a] = (first[a](x, y) + second[a](x, y)) / 2;
      const float missing = ((s0(x, y) + second_s0(x, y)) - sum) / 4;  // S0 is half of the planes' sum
      for (std::size_t a = 0; a < 4; ++a) second[a](x, y) = mean[a] + missing;
    }
  });
  return second;
}

std::vector<AnglePlanes> InterpolateSharp(const Image<float>& samples, const Layout& layout) {
  return InterpolateByColour(samples, layout, [](const Image<float>& mono, const Layout& angles) {
    return FillSharp(mono, angles, FittedKernels());
  });
}

}  // namespace polarscan
