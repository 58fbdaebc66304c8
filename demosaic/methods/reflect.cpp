// SPDX-License-Identifier: Apache-2.0
#include "demosaic/methods/reflect.h"

#include <algorithm>

#include "core/parallel.h"

namespace polarscan {

void PadRow(const float* row, int width, int border, float* out) {
  std::copy_n(row, width, out + border);
  for (int i = 1; i <= border; ++i) {
    out[border - i] = row[Reflect(-i, width)];
    out[border + width - 1 + i] = row[Reflect(width - 1 + i, width)];
  }
}

Image<float> Pad(const Image<float>& image, int border) { return PadRows(image, border, 0, image.height()); }

Image<float> PadRows(const Image<float>& image, int border, int first, int last) {
  Image<float> padded(image.width() + 2 * border, last - first + 2 * border);
  ParallelFor(0, padded.height(), [&](int y) {
    PadRow(image.row(Reflect(first + y - border, image.height())), image.width(), border, padded.row(y));
  });
  return padded;
}

}  // namespace polarscan
