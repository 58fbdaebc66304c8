// SPDX-License-Identifier: Apache-2.0
#include "demosaic/bilinear.h"

#include "core/error.h"
#include "core/parallel.h"

namespace polarscan {
namespace {

// Which phases of a 2x2 cell hold the wanted kind of sample; phase = 2 (row parity) + (column parity).
using Sites = std::array<bool, 4>;

// Where a pixel finds its nearest wanted samples.
enum class Nearest { kSelf, kRow, kColumn, kCross, kDiagonal };

Nearest NearestSites(const Sites& wanted, std::size_t phase) {
  if (wanted[phase]) return Nearest::kSelf;
  const bool row = wanted[phase ^ 1], column = wanted[phase ^ 2];
  if (row && column) return Nearest::kCross;
  return row ? Nearest::kRow : column ? Nearest::kColumn : Nearest::kDiagonal;
}

// The neighbour at i - step and at i + step; one that would lie outside is replaced by the other one.
struct Pair {
  int before, after;
};
Pair Neighbours(int i, int step, int size) {
  return {i >= step ? i - step : i + step, i + step < size ? i + step : i - step};
}

struct Rows {
  const float *above, *here, *below;
};

float MeanAt(Nearest nearest, const Rows& rows, Pair column, int x) {
  const int l = column.before, r = column.after;
  switch (nearest) {
    case Nearest::kRow:
      return 0.5f * (rows.here[l] + rows.here[r]);
    case Nearest::kColumn:
      return 0.5f * (rows.above[x] + rows.below[x]);
    case Nearest::kCross:
      return 0.25f * (rows.here[l] + rows.here[r] + rows.above[x] + rows.below[x]);
    case Nearest::kDiagonal:
      return 0.25f * (rows.above[l] + rows.above[r] + rows.below[l] + rows.below[r]);
    default:
      return rows.here[x];
  }
}

// Every pixel gets the wanted kind. Phases change every `step` pixels: 1 for polarizers, 2 for colour blocks.
Image<float> Fill(const Image<float>& samples, const Sites& wanted, int step) {
  const int width = samples.width(), height = samples.height();
  Image<float> filled(width, height);
  ParallelFor(0, height, [&](int y) {
    const Pair row = Neighbours(y, step, height);
    const Rows rows = {samples.row(row.before), samples.row(y), samples.row(row.after)};
    const std::size_t first = std::size_t(2 * ((y / step) & 1));
    const Nearest nearest[2] = {NearestSites(wanted, first), NearestSites(wanted, first + 1)};
    float* out = filled.row(y);
    for (int x = 0; x < width; ++x)
      out[x] = MeanAt(nearest[(x / step) & 1], rows, Neighbours(x, step, width), x);
  });
  return filled;
}

AnglePlanes FillAngles(const Image<float>& samples, const Layout& layout) {
  AnglePlanes planes;
  for (std::size_t a = 0; a < 4; ++a) {
    Sites wanted;
    for (std::size_t i = 0; i < 4; ++i) wanted[i] = layout.angles_deg[i] == kAnglesDeg[a];
    planes[a] = Fill(samples, wanted, 1);
  }
  return planes;
}

Image<float> FillColour(const Image<float>& samples, const Layout& layout, char colour) {
  Sites wanted;
  for (std::size_t i = 0; i < 4; ++i) wanted[i] = layout.bayer[i] == colour;
  return Fill(samples, wanted, 2);
}

}  // namespace

std::vector<AnglePlanes> InterpolateBilinear(const Image<float>& samples, const Layout& layout) {
  if (samples.width() < 4 || samples.height() < 4)
    throw Error("a mosaic needs at least 4x4 pixels",
                std::to_string(samples.width()) + "x" + std::to_string(samples.height()));
  if (layout.bayer.empty()) return {FillAngles(samples, layout)};
  std::vector<AnglePlanes> colours;
  for (const char colour : {'r', 'g', 'b'})
    colours.push_back(FillAngles(FillColour(samples, layout, colour), layout));
  return colours;
}

}  // namespace polarscan
