// SPDX-License-Identifier: Apache-2.0
#include "demosaic/methods/newton.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "demosaic/bayer.h"
#include "demosaic/methods/reflect.h"

namespace polarscan {
namespace {

constexpr float kClearly = 5.8f;            // ratio of misfits from which one direction is taken alone
constexpr float kSmallestGradient = 1e-6f;  // of gradients, in units of full scale

// By place in the cell against the pixel's own: the samples, and the estimates of the three others.
// [0] own, [1] the one beside it in the row, [2] in the column, [3] across the cell.
using Places = std::array<Image<float>, 4>;

struct Direction {
  int dx, dy;
};

constexpr int kLineBorder = 3;  // what a line reaches

std::ptrdiff_t Step(const Image<float>& padded, Direction d) {
  return d.dy * std::ptrdiff_t(padded.width()) + d.dx;
}

// The wanted kind at every pixel along a direction: padded `own` holds the pixel's kind at even places,
// `wanted` the wanted one at odd places.
Image<float> Estimate(const Image<float>& own, const Image<float>& wanted, Direction d) {
  const std::ptrdiff_t step = Step(own, d);
  Image<float> estimate(own.width() - 2 * kLineBorder, own.height() - 2 * kLineBorder);
  ParallelFor(0, estimate.height(), [&](int y) {
    const float *o = own.row(y + kLineBorder) + kLineBorder, *w = wanted.row(y + kLineBorder) + kLineBorder;
    float* out = estimate.row(y);
    for (int x = 0; x < estimate.width(); ++x, ++o, ++w)
      out[x] = (7 * (w[-step] + w[step]) + (w[-3 * step] + w[3 * step])) / 16 +
               (2 * o[0] - o[-2 * step] - o[2 * step]) / 4;
  });
  return estimate;
}

// Sum over the nearest nine pixels of the same kind of |estimate - sample|.
Image<float> Misfit(const Image<float>& estimate, const Image<float>& samples) {
  const int width = samples.width(), height = samples.height();
  Image<float> away(width, height), misfit(width, height);
  for (std::size_t i = 0; i < away.size(); ++i)
    away.pixels()[i] = std::abs(estimate.pixels()[i] - samples.pixels()[i]);
  const Image<float> padded = Pad(away, 2);
  ParallelFor(0, height, [&](int y) {
    std::vector<float> column(std::size_t(padded.width()));
    const float *a = padded.row(y), *b = padded.row(y + 2), *c = padded.row(y + 4);
    for (std::size_t x = 0; x < column.size(); ++x) column[x] = a[x] + b[x] + c[x];
    for (int x = 0; x < width; ++x) {
      const float* at = column.data() + x;
      misfit(x, y) = at[0] + at[2] + at[4];
    }
  });
  return misfit;
}

// How much the picture changes along the direction at each of `count` places of a padded row.
void Changes(const float* row, std::ptrdiff_t step, int count, float* out) {
  for (int x = 0; x < count; ++x, ++row)
    out[x] = std::abs(row[-step] - row[step]) + std::abs(2 * row[0] - row[-2 * step] - row[2 * step]);
}

// The better of two estimates, or their mean weighted by smoothness.
Image<float> Join(const Image<float>& samples, const Image<float>& padded, const Image<float>& a,
                  Direction da, const Image<float>& b, Direction db) {
  const Image<float> misfit_a = Misfit(a, samples), misfit_b = Misfit(b, samples);
  Image<float> joined(samples.width(), samples.height());
  ParallelFor(0, samples.height(), [&](int y) {
    const float* row = padded.row(y + kLineBorder) + kLineBorder;
    std::vector<float> change_a(std::size_t(samples.width())), change_b = change_a;
    Changes(row, Step(padded, da), samples.width(), change_a.data());
    Changes(row, Step(padded, db), samples.width(), change_b.data());
    for (int x = 0; x < samples.width(); ++x) {
      const float ma = misfit_a(x, y) + kSmallestGradient, mb = misfit_b(x, y) + kSmallestGradient;
      const float wa = 1 / (change_a[std::size_t(x)] + kSmallestGradient),
                  wb = 1 / (change_b[std::size_t(x)] + kSmallestGradient);
      joined(x, y) = mb > kClearly * ma   ? a(x, y)
                     : ma > kClearly * mb ? b(x, y)
                                          : (wa * a(x, y) + wb * b(x, y)) / (wa + wb);
    }
  });
  return joined;
}

constexpr Direction kRow{1, 0}, kColumn{0, 1}, kFalling{1, 1}, kRising{1, -1};

Places FillPlaces(const Image<float>& samples) {
  const Image<float> own = Pad(samples, kLineBorder);
  const auto join = [&](const Image<float>& wanted_a, Direction a, const Image<float>& wanted_b,
                        Direction b) {
    return Join(samples, own, Estimate(own, wanted_a, a), a, Estimate(own, wanted_b, b), b);
  };
  Places places;
  places[0] = samples;
  places[3] = join(own, kFalling, own, kRising);
  // The pixel above holds the column's kind; the one across the cell from it is the row's kind.
  const Image<float> opposite = Pad(places[3], kLineBorder);
  places[1] = join(own, kRow, opposite, kColumn);
  places[2] = join(own, kColumn, opposite, kRow);
  return places;
}

AnglePlanes FillByNewton(const Image<float>& samples, const Layout& layout) {
  const Places places = FillPlaces(samples);
  const Image<float> empty(samples.width(), samples.height());
  AnglePlanes planes = {empty, empty, empty, empty};
  ParallelFor(0, samples.height(), [&](int y) {
    for (int x = 0; x < samples.width(); ++x)
      for (std::size_t place = 0; place < 4; ++place) {
        const int angle = layout.AngleAt(x ^ int(place & 1), y ^ int(place >> 1));
        planes[std::size_t(angle / 45)](x, y) = places[place](x, y);
      }
  });
  return planes;
}

}  // namespace

std::vector<AnglePlanes> InterpolateNewton(const Image<float>& samples, const Layout& layout) {
  return InterpolateByColour(samples, layout, FillByNewton);
}

}  // namespace polarscan
