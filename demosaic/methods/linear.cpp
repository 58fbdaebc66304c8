// SPDX-License-Identifier: Apache-2.0
#include "demosaic/methods/linear.h"

#include <algorithm>
#include <utility>

#include "core/parallel.h"
#include "demosaic/bayer.h"
#include "demosaic/methods/bilinear.h"
#include "demosaic/methods/reflect.h"

namespace polarscan {
namespace {

using Kernel = LinearKernels::Kernel;

constexpr int kKernelReach = 3;

Kernel Transpose(const Kernel& kernel) {
  Kernel transposed;
  for (std::size_t i = 0; i < 16; ++i) transposed[i] = kernel[i % 4 * 4 + i / 4];
  return transposed;
}

}  // namespace

LinearKernels::Set KernelsFor(const std::array<Carrier, 2>& carriers, const LinearKernels& kernels) {
  if (carriers[0].row && !carriers[0].column && carriers[1].column && !carriers[1].row) return kernels.across;
  if (carriers[0].column) return kernels.in_row;
  const LinearKernels::Set& set = kernels.in_row;
  return {Transpose(set.s0), Transpose(set.first), Transpose(set.second)};
}

const LinearKernels& FittedKernels() {
  static const LinearKernels kernels = {
#include "demosaic/methods/linear_kernels.inc"
  };
  return kernels;
}

std::array<Carrier, 2> Carriers(const Layout& layout) {
  std::array<Carrier, 3> all = {Carrier{true, false}, Carrier{false, true}, Carrier{true, true}};
  for (Carrier& carrier : all)
    for (int y = 0; y < 2; ++y)
      for (int x = 0; x < 2; ++x) {
        const int angle = layout.AngleAt(x, y);
        const float share = carrier.SignAt(x, y) / 4;
        carrier.q1 += angle == 0 ? share : angle == 90 ? -share : 0;
        carrier.q2 += angle == 45 ? share : angle == 135 ? -share : 0;
      }
  const auto end = std::remove_if(all.begin(), all.end(), [](const Carrier& c) { return c.q1 == 0; });
  if (end - all.begin() != 2) std::abort();  // of any four different angles, one carrier is empty
  return {all[0], all[1]};
}

Image<float> Convolve(const Image<float>& image, const Kernel& kernel) {
  const int width = image.width(), height = image.height();
  const Image<float> padded = Pad(image, kKernelReach);
  Image<float> result(width, height);
  ParallelFor(0, height, [&](int y) {
    std::vector<float> sum(std::size_t(padded.width()));
    float* out = result.row(y);
    for (int v = 0; v <= kKernelReach; ++v) {
      const float *above = padded.row(y + kKernelReach - v), *below = padded.row(y + kKernelReach + v);
      for (int x = 0; x < padded.width(); ++x) sum[std::size_t(x)] = v == 0 ? above[x] : above[x] + below[x];
      const float* taps = kernel.data() + 4 * v;
      const float* s = sum.data() + kKernelReach;
      for (int x = 0; x < width; ++x)
        out[x] += taps[0] * s[x] + taps[1] * (s[x - 1] + s[x + 1]) + taps[2] * (s[x - 2] + s[x + 2]) +
                  taps[3] * (s[x - 3] + s[x + 3]);
    }
  });
  return result;
}

AnglePlanes FillByKernels(const Image<float>& samples, const Layout& layout, const LinearKernels& kernels) {
  const std::array<Carrier, 2> carriers = Carriers(layout);
  const LinearKernels::Set set = KernelsFor(carriers, kernels);
  const Image<float> s0 = Convolve(samples, set.s0), first = Convolve(samples, set.first),
                     second = Convolve(samples, set.second);
  AnglePlanes planes = FillAngles(samples, layout);
  const Carrier &a = carriers[0], &b = carriers[1];
  ParallelFor(0, samples.height(), [&](int y) {
    for (int x = 0; x < samples.width(); ++x) {
      const float redundancy = planes[0](x, y) + planes[2](x, y) - planes[1](x, y) - planes[3](x, y);
      // The two Q are orthogonal mixtures of length sqrt(1/2); the kernels see M, half of what carries them.
      const float qa = 4 * a.SignAt(x, y) * first(x, y), qb = 4 * b.SignAt(x, y) * second(x, y);
      const float s1 = a.q1 * qa + b.q1 * qb, s2 = a.q2 * qa + b.q2 * qb;
      const float straight = s0(x, y) + redundancy / 4, diagonal = s0(x, y) - redundancy / 4;
      planes[0](x, y) = straight + s1 / 2, planes[2](x, y) = straight - s1 / 2;
      planes[1](x, y) = diagonal + s2 / 2, planes[3](x, y) = diagonal - s2 / 2;
    }
  });
  return planes;
}

std::vector<AnglePlanes> InterpolateLinear(const Image<float>& samples, const Layout& layout) {
  return InterpolateByColour(samples, layout, [](const Image<float>& mono, const Layout& angles) {
    return FillByKernels(mono, angles, FittedKernels());
  });
}

}  // namespace polarscan
