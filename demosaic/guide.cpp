// SPDX-License-Identifier: Apache-2.0
#include "demosaic/guide.h"

#include <cmath>

#include "core/parallel.h"
#include "demosaic/reflect.h"

namespace polarscan {
namespace {

constexpr int kGuideBorder = 4;  // what the differences' averages reach, and one
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
  Image<float> rows(width, height), sums(width, height);
  ParallelFor(ry, height - ry, [&](int y) {
    float* out = rows.row(y);
    for (int k = -ry; k <= ry; ++k)
      for (int x = 0; x < width; ++x) out[x] += image(x, y + k);
    for (int k = -rx; k <= rx; ++k)
      for (int x = rx; x < width - rx; ++x) sums(x, y) += out[x + k];
  });
  return sums;
}

}  // namespace

Image<float> EdgeAwareGuide(const Image<float>& samples) {
  const Image<float> padded = Pad(samples, kGuideBorder);
  const int width = padded.width(), height = padded.height();
  Side above{Image<float>(width, height), Image<float>(width, height)}, left = above;
  ParallelFor(1, height, [&](int y) {
    MeasurePair(padded.row(y) + 1, padded.row(y - 1) + 1, 1, width - 2, above.mean.row(y) + 1,
                above.edges.row(y) + 1);
  });
  ParallelFor(1, height - 1, [&](int y) {
    MeasurePair(padded.row(y) + 1, padded.row(y), width, width - 1, left.mean.row(y) + 1,
                left.edges.row(y) + 1);
  });
  above.edges = BoxSum(above.edges, 5, 3), left.edges = BoxSum(left.edges, 3, 5);
  Image<float> guide(samples.width(), samples.height());
  ParallelFor(0, samples.height(), [&](int j) {
    const int y = j + kGuideBorder;
    for (int i = 0; i < samples.width(); ++i) {
      const int x = i + kGuideBorder;
      const auto weight = [](float edges) { return 1 / (edges / 15 + kSmallestEdge); };
      const float north = weight(above.edges(x, y - 1)), south = weight(above.edges(x, y + 2));
      const float west = weight(left.edges(x - 1, y)), east = weight(left.edges(x + 2, y));
      guide(i, j) = (north * above.mean(x, y) + south * above.mean(x, y + 1) + west * left.mean(x, y) +
                     east * left.mean(x + 1, y)) /
                    (north + south + west + east);
    }
  });
  return guide;
}

}  // namespace polarscan
