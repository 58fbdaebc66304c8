// SPDX-License-Identifier: Apache-2.0
#include "demosaic/newton.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "demosaic/bayer.h"
#include "demosaic/reflect.h"

namespace polarscan {
namespace {

constexpr float kClearly = 5.8f;            // ratio of misfits from which one direction is taken alone
constexpr float kSmallestGradient = 1e-6f;  // of gradients, in units of full scale

// By place in the cell against the pixel's own: the samples, and the estimates of the three others.
// [0] own, [1] the one beside it in the row, [2] in the column, [3] across the cell.
using Places = std::array<Image<float>, 4>;

// The wanted kind at (x, y) along (dx, dy): `own` holds the pixel's kind at even places, `wanted` the wanted
// one at odd places.
float AlongLine(const Image<float>& own, const Image<float>& wanted, int x, int y, int dx, int dy) {
  const auto at = [&](const Image<float>& image, int k) {
    return image(Reflect(x + k * dx, image.width()), Reflect(y + k * dy, image.height()));
  };
  const float near = at(wanted, -1) + at(wanted, 1), far = at(wanted, -3) + at(wanted, 3);
  const float bend = 2 * at(own, 0) - at(own, -2) - at(own, 2);
  return (7 * near + far) / 16 + bend / 4;
}

// How much the picture changes along (dx, dy).
float Change(const Image<float>& samples, int x, int y, int dx, int dy) {
  const auto at = [&](int k) {
    return samples(Reflect(x + k * dx, samples.width()), Reflect(y + k * dy, samples.height()));
  };
  return std::abs(at(-1) - at(1)) + std::abs(2 * at(0) - at(-2) - at(2));
}

struct Direction {
  int dx, dy;
};

// Sum over the nearest nine pixels of the same kind of |estimate - sample|.
Image<float> Misfit(const Image<float>& estimate, const Image<float>& samples) {
  const int width = samples.width(), height = samples.height();
  const auto at = [&](int x, int y) { return std::abs(estimate(x, y) - samples(x, y)); };
  Image<float> misfit(width, height);
  ParallelFor(0, height, [&](int y) {
    for (int x = 0; x < width; ++x)
      for (int v = -2; v <= 2; v += 2)
        for (int u = -2; u <= 2; u += 2) misfit(x, y) += at(Reflect(x + u, width), Reflect(y + v, height));
  });
  return misfit;
}

// The better of two estimates, or their mean weighted by smoothness.
Image<float> Join(const Image<float>& samples, const Image<float>& a, Direction da, const Image<float>& b,
                  Direction db) {
  const Image<float> misfit_a = Misfit(a, samples), misfit_b = Misfit(b, samples);
  Image<float> joined(samples.width(), samples.height());
  ParallelFor(0, samples.height(), [&](int y) {
    for (int x = 0; x < samples.width(); ++x) {
      const float ma = misfit_a(x, y) + kSmallestGradient, mb = misfit_b(x, y) + kSmallestGradient;
      const float wa = 1 / (Change(samples, x, y, da.dx, da.dy) + kSmallestGradient),
                  wb = 1 / (Change(samples, x, y, db.dx, db.dy) + kSmallestGradient);
      joined(x, y) = mb > kClearly * ma   ? a(x, y)
                     : ma > kClearly * mb ? b(x, y)
                                          : (wa * a(x, y) + wb * b(x, y)) / (wa + wb);
    }
  });
  return joined;
}

Image<float> Estimate(const Image<float>& own, const Image<float>& wanted, Direction d) {
  Image<float> estimate(own.width(), own.height());
  ParallelFor(0, own.height(), [&](int y) {
    for (int x = 0; x < own.width(); ++x) estimate(x, y) = AlongLine(own, wanted, x, y, d.dx, d.dy);
  });
  return estimate;
}

constexpr Direction kRow{1, 0}, kColumn{0, 1}, kFalling{1, 1}, kRising{1, -1};

Places FillPlaces(const Image<float>& samples) {
  Places places;
  places[0] = samples;
  places[3] = Join(samples, Estimate(samples, samples, kFalling), kFalling,
                   Estimate(samples, samples, kRising), kRising);
  // The pixel above holds the column's kind; the one across the cell from it is the row's kind.
  places[1] =
      Join(samples, Estimate(samples, samples, kRow), kRow, Estimate(samples, places[3], kColumn), kColumn);
  places[2] =
      Join(samples, Estimate(samples, samples, kColumn), kColumn, Estimate(samples, places[3], kRow), kRow);
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
