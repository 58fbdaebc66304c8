// SPDX-License-Identifier: Apache-2.0
#include "demosaic/methods/guide.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/parallel.h"
#include "demosaic/methods/reflect.h"

namespace polarscan {
namespace {

constexpr int kGuideBorder = 4;  // what the differences' averages reach, and one
constexpr int kGuideBand = 32;   // px: its intermediates stay in the cache
constexpr float kSmallestEdge = 1e-4f;

// What lies between two neighbouring rows (or columns): at index i, between i - 1 and i.
struct Side {
  Image<float> mean, edges;
};

// [1 2 1] / 4 of two rows' mean, and |[-1 2 -1] / 2| of their difference; step leads along a row, across to
// the row before.
void MeasurePair(const float* here, const float* before, int step, int count, float* mean, float* edges) {
  for (int x = 0; x < count; ++x) {
    const float *a = before + x, *b = here + x;
    mean[x] = ((a[-step] + b[-step]) + 2 * (a[0] + b[0]) + (a[step] + b[step])) / 8;
    edges[x] = std::abs((a[0] - b[0]) - 0.5f * ((a[-step] - b[-step]) + (a[step] - b[step])));
  }
}

// Sum over `wide` x `high` pixels, odd numbers; the border of half their size is left 0.
Image<float> BoxSum(const Image<float>& image, int wide, int high) {
  const int width = image.width(), height = image.height(), rx = wide / 2, ry = high / 2;
  Image<float> sums(width, height);
  std::vector<float> column(static_cast<std::size_t>(width));
  for (int y = ry; y < height - ry; ++y) {
    std::ranges::fill(column, 0.0f);
    for (int k = -ry; k <= ry; ++k) {
      const float* row = image.row(y + k);
      for (int x = 0; x < width; ++x) column[std::size_t(x)] += row[x];
    }
    float* out = sums.row(y);
    for (int k = -rx; k <= rx; ++k)
      for (int x = rx; x < width - rx; ++x) out[x] += column[std::size_t(x + k)];
  }
  return sums;
}

float Weight(float edges) { return 1 / (edges / 15 + kSmallestEdge); }

// Rows first ... last - 1 of the guide.
void GuideBand(const Image<float>& samples, int first, int last, Image<float>& guide) {
  const Image<float> padded = PadRows(samples, kGuideBorder, first, last);
  const int width = padded.width(), height = padded.height();
  Side above{Image<float>(width, height), Image<float>(width, height)}, left = above;
  for (int y = 1; y < height; ++y)
    MeasurePair(padded.row(y) + 1, padded.row(y - 1) + 1, 1, width - 2, above.mean.row(y) + 1,
                above.edges.row(y) + 1);
  for (int y = 1; y < height - 1; ++y)
    MeasurePair(padded.row(y) + 1, padded.row(y), width, width - 1, left.mean.row(y) + 1,
                left.edges.row(y) + 1);
  above.edges = BoxSum(above.edges, 5, 3), left.edges = BoxSum(left.edges, 3, 5);
  for (int j = first; j < last; ++j) {
    const int y = j - first + kGuideBorder;
    const auto at = [](const Image<float>& image, int row) { return image.row(row) + kGuideBorder; };
    const float *edges_north = at(above.edges, y - 1), *edges_south = at(above.edges, y + 2);
    const float *edges = at(left.edges, y), *north = at(above.mean, y), *south = at(above.mean, y + 1),
                *sides = at(left.mean, y);
    float* out = guide.row(j);
    for (int x = 0; x < samples.width(); ++x) {
      const float n = Weight(edges_north[x]), s = Weight(edges_south[x]), w = Weight(edges[x - 1]),
                  e = Weight(edges[x + 2]);
      out[x] = (n * north[x] + s * south[x] + w * sides[x] + e * sides[x + 1]) / (n + s + w + e);
    }
  }
}

}  // namespace

Image<float> EdgeAwareGuide(const Image<float>& samples) {
  Image<float> guide(samples.width(), samples.height());
  const int bands = (samples.height() + kGuideBand - 1) / kGuideBand;
  ParallelFor(0, bands, [&](int band) {
    GuideBand(samples, band * kGuideBand, std::min(samples.height(), (band + 1) * kGuideBand), guide);
  });
  return guide;
}

}  // namespace polarscan
