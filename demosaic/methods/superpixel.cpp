// SPDX-License-Identifier: Apache-2.0
#include "demosaic/methods/superpixel.h"

#include <algorithm>

#include "core/parallel.h"
#include "demosaic/methods/bilinear.h"

namespace polarscan {
namespace {

// The mean over the blocks of this colour of the samples behind polarizer `site` of the cell at (x0, y0).
float CellSample(const Image<float>& samples, const Layout& layout, char colour, int x0, int y0, int site) {
  const int px = site & 1, py = site >> 1;
  if (colour == 'm') return samples(x0 + px, y0 + py);
  float sum = 0, count = 0;
  for (int by = 0; by < 4; by += 2)
    for (int bx = 0; bx < 4; bx += 2)
      if (layout.ColourAt(bx, by) == colour) sum += samples(x0 + bx + px, y0 + by + py), ++count;
  return sum / count;
}

AnglePlanes Repeat(const Image<float>& samples, const Layout& layout, char colour) {
  const int width = samples.width(), height = samples.height(), cell = colour == 'm' ? 2 : 4;
  const Image<float> empty(width, height);
  AnglePlanes planes = {empty, empty, empty, empty};
  const int across = width / cell, down = height / cell;
  ParallelFor(0, down, [&](int v) {
    const int last = v + 1 == down ? height : (v + 1) * cell;
    for (int u = 0; u < across; ++u) {
      const int x0 = u * cell, count = (u + 1 == across ? width : x0 + cell) - x0;
      for (int site = 0; site < 4; ++site) {
        const float sample = CellSample(samples, layout, colour, x0, v * cell, site);
        Image<float>& plane = planes[std::size_t(layout.angles_deg[std::size_t(site)] / 45)];
        for (int y = v * cell; y < last; ++y) std::fill_n(plane.row(y) + x0, count, sample);
      }
    }
  });
  return planes;
}

}  // namespace

std::vector<AnglePlanes> RepeatSuperpixels(const Image<float>& samples, const Layout& layout) {
  CheckMosaicSize(samples);
  if (layout.bayer.empty()) return {Repeat(samples, layout, 'm')};
  return {Repeat(samples, layout, 'r'), Repeat(samples, layout, 'g'), Repeat(samples, layout, 'b')};
}

}  // namespace polarscan
