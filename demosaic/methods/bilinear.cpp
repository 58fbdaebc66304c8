// SPDX-License-Identifier: Apache-2.0
#include "demosaic/methods/bilinear.h"

#include <algorithm>

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

// out[x] = f(x) for the pixels of a row that have this column parity; phases change every `step` pixels.
template <class F>
void SetColumns(int parity, int step, int width, float* out, F&& f) {
  for (int first = parity * step; first < width; first += 2 * step)
    for (int x = first; x < std::min(first + step, width); ++x) out[x] = f(x);
}

void FillColumns(Nearest nearest, int parity, int step, int width, const Rows& rows, float* out) {
  const auto [above, here, below] = rows;
  const auto set = [&](auto&& f) { SetColumns(parity, step, width, out, f); };
  const auto pair = [&](int x) { return Neighbours(x, step, width); };
  switch (nearest) {
    case Nearest::kSelf:
      return set([&](int x) { return here[x]; });
    case Nearest::kRow:
      return set([&](int x) { return 0.5f * (here[pair(x).before] + here[pair(x).after]); });
    case Nearest::kColumn:
      return set([&](int x) { return 0.5f * (above[x] + below[x]); });
    case Nearest::kCross:
      return set(
          [&](int x) { return 0.25f * (here[pair(x).before] + here[pair(x).after] + above[x] + below[x]); });
    case Nearest::kDiagonal:
      return set([&](int x) {
        const auto [left, right] = pair(x);
        return 0.25f * (above[left] + above[right] + below[left] + below[right]);
      });
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
    for (int parity = 0; parity < 2; ++parity)
      FillColumns(NearestSites(wanted, first + std::size_t(parity)), parity, step, width, rows,
                  filled.row(y));
  });
  return filled;
}

Image<float> FillColour(const Image<float>& samples, const Layout& layout, char colour) {
  Sites wanted;
  for (std::size_t i = 0; i < 4; ++i) wanted[i] = layout.bayer[i] == colour;
  return Fill(samples, wanted, 2);
}

}  // namespace

AnglePlanes FillAngles(const Image<float>& samples, const Layout& layout) {
  AnglePlanes planes;
  for (std::size_t a = 0; a < 4; ++a) {
    Sites wanted;
    for (std::size_t i = 0; i < 4; ++i) wanted[i] = layout.angles_deg[i] == kAnglesDeg[a];
    planes[a] = Fill(samples, wanted, 1);
  }
  return planes;
}

void CheckMosaicSize(const Image<float>& samples) {
  if (samples.width() < 4 || samples.height() < 4)
    throw Error("a mosaic needs at least 4x4 pixels",
                std::to_string(samples.width()) + "x" + std::to_string(samples.height()));
}

std::vector<AnglePlanes> InterpolateBilinear(const Image<float>& samples, const Layout& layout) {
  CheckMosaicSize(samples);
  if (layout.bayer.empty()) return {FillAngles(samples, layout)};
  std::vector<AnglePlanes> colours;
  for (const char colour : {'r', 'g', 'b'})
    colours.push_back(FillAngles(FillColour(samples, layout, colour), layout));
  return colours;
}

}  // namespace polarscan
