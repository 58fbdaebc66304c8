// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/image.h"

namespace polarscan {

// The value below which a share q in [0, 1] of the values lie; 0 if there are none.
inline double Quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  const auto nth = values.begin() + std::ptrdiff_t(q * double(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

// Full scale of a legend for degrees of polarization: the 98 % quantile, rounded up to twentieths, 0.1 to 1.
inline double DopFullScale(const std::vector<double>& dop) {
  return std::clamp(std::ceil(Quantile(dop, 0.98) * 20) / 20, 0.1, 1.0);
}

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

// RFC 4648.
inline std::string Base64(std::string_view bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (k < count ? std::uint8_t(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[word >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

}  // namespace polarscan
