// SPDX-License-Identifier: Apache-2.0
#include "demosaic/methods/difference.h"

#include "core/parallel.h"
#include "demosaic/bayer.h"
#include "demosaic/methods/bilinear.h"
#include "demosaic/methods/guide.h"

namespace polarscan {
namespace {

AnglePlanes FillByDifference(const Image<float>& samples, const Layout& layout) {
  const Image<float> guide = EdgeAwareGuide(samples);
  Image<float> differences(samples.width(), samples.height());
  for (std::size_t i = 0; i < guide.size(); ++i)
    differences.pixels()[i] = samples.pixels()[i] - guide.pixels()[i];
  AnglePlanes planes = FillAngles(differences, layout);
  ParallelFor(0, samples.height(), [&](int y) {
    for (Image<float>& plane : planes)
      for (int x = 0; x < samples.width(); ++x) plane(x, y) += guide(x, y);
  });
  return planes;
}

}  // namespace

std::vector<AnglePlanes> InterpolateDifference(const Image<float>& samples, const Layout& layout) {
  return InterpolateByColour(samples, layout, FillByDifference);
}

}  // namespace polarscan
