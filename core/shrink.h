// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "core/image.h"

namespace polarscan {

// width and height with the longest side at most `longest`.
inline std::pair<int, int> FitSize(int width, int height, int longest) {
  const double scale = std::min(1.0, double(longest) / std::max(width, height));
  return {std::max(1, int(std::lround(width * scale))), std::max(1, int(std::lround(height * scale)))};
}

// Mean of the used pixels under each pixel of a smaller picture; `none` where fewer than a quarter are used.
// use(x, y) -> bool. T needs + and / by a float.
template <class T, class Use>
Image<T> Shrink(const Image<T>& image, int width, int height, const T& none, Use&& use) {
  Image<T> small(width, height, none);
  const auto edge = [](int i, int from, int to) { return int(std::int64_t(i) * from / to); };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int x0 = edge(x, image.width(), width), x1 = std::max(x0 + 1, edge(x + 1, image.width(), width));
      const int y0 = edge(y, image.height(), height),
                y1 = std::max(y0 + 1, edge(y + 1, image.height(), height));
      T sum = none;
      int used = 0;
      for (int v = y0; v < y1; ++v)
        for (int u = x0; u < x1; ++u) {
          if (!use(u, v)) continue;
          sum = used++ ? T(sum + image(u, v)) : image(u, v);
        }
      if (4 * used >= (x1 - x0) * (y1 - y0)) small(x, y) = sum / float(std::max(used, 1));
    }
  return small;
}

}  // namespace polarscan
