// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/image.h"

namespace polarscan {

// Index of the sample that stands for one outside of 0 ... size - 1: reflected at the centre of the border
// sample, -1 -> 1, size -> size - 2, as often as it takes. Keeps even even and odd odd, so that a mosaic
// goes on beyond its border with the same filters.
inline int Reflect(int i, int size) {
  if (size == 1) return 0;
  const int period = 2 * (size - 1), inside = ((i % period) + period) % period;
  return inside < size ? inside : period - inside;
}

// The picture with `border` reflected pixels on every side.
Image<float> Pad(const Image<float>& image, int border);

// Rows first ... last - 1 of the picture and `border` more on every side; reflected where there are none.
Image<float> PadRows(const Image<float>& image, int border, int first, int last);

// One row of it: out[0 ... width + 2 border).
void PadRow(const float* row, int width, int border, float* out);

}  // namespace polarscan
