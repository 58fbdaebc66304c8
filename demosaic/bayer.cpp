// SPDX-License-Identifier: Apache-2.0
#include "demosaic/bayer.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "demosaic/bilinear.h"
#include "demosaic/reflect.h"
#include "demosaic/residual.h"

namespace polarscan {
namespace {

constexpr int kFalloffReach = 4;  // of the directional means, px of the half-size picture
constexpr int kLineReach = 5;     // half width of the regression along a line, px
constexpr float kSmallestSquare = 1e-10f;
constexpr std::array<float, kFalloffReach + 1> kFalloff = {0.56f, 0.35f, 0.08f, 0.01f,
                                                           0.f};  // Gaussian, sigma 1 px

// A line of alternating kinds: kind 0 at even, kind 1 at odd places, linearly interpolated to all places.
struct Line {
  std::array<std::vector<float>, 2> kind;
};

Line Alternate(const std::vector<float>& samples) {
  const int size = int(samples.size());
  Line line{{samples, samples}};
  for (int i = 0; i < size; ++i) {
    const float between =
        0.5f * (samples[std::size_t(Reflect(i - 1, size))] + samples[std::size_t(Reflect(i + 1, size))]);
    line.kind[std::size_t((i + 1) & 1)][std::size_t(i)] = between;
  }
  return line;
}

// The samples of one kind (every second place from `first` on) spread along the line by residual
// interpolation: a guide + b within +- 5 px by least squares, then the rest linearly.
std::vector<float> FillLine(const std::vector<float>& samples, const std::vector<float>& guide, int first) {
  const int size = int(samples.size());
  std::vector<float> tentative(samples.size()), filled(samples.size());
  for (int i = 0; i < size; ++i) {
    float n = 0, g = 0, d = 0, gg = 0, gd = 0;
    const float origin = guide[std::size_t(i)];
    for (int k = i - kLineReach; k <= i + kLineReach; ++k) {
      if (((k - first) & 1) != 0) continue;
      const std::size_t at = std::size_t(Reflect(k, size));
      const float u = guide[at] - origin, v = samples[at] - guide[at];
      ++n, g += u, d += v, gg += u * u, gd += u * v;
    }
    const float slope = (gd - g * d / n) / (gg - g * g / n + kSmallestSquare);
    tentative[std::size_t(i)] = origin + (d - slope * g) / n;
  }
  for (int i = 0; i < size; ++i) {
    const auto rest = [&](int k) {
      const std::size_t at = std::size_t(Reflect(k, size));
      return samples[at] - tentative[at];
    };
    const bool own = ((i - first) & 1) == 0;
    filled[std::size_t(i)] = tentative[std::size_t(i)] + (own ? rest(i) : 0.5f * (rest(i - 1) + rest(i + 1)));
  }
  return filled;
}

// Green minus the line's other colour at every place of a line; green at even places if first_green is 0.
std::vector<float> ColourDifference(const std::vector<float>& samples, int first_green) {
  if (samples.size() < 2) return std::vector<float>(samples.size());
  const Line linear = Alternate(samples);
  const std::size_t green_kind = std::size_t(first_green), other_kind = 1 - green_kind;
  const std::vector<float> green = FillLine(samples, linear.kind[other_kind], first_green);
  const std::vector<float> other = FillLine(samples, linear.kind[green_kind], 1 - first_green);
  std::vector<float> difference(samples.size());
  for (std::size_t i = 0; i < difference.size(); ++i) difference[i] = green[i] - other[i];
  return difference;
}

struct Directions {
  Image<float> along_rows, along_columns;
};

bool IsGreen(const std::string& bayer, int x, int y) {
  return bayer[std::size_t((y & 1) * 2 + (x & 1))] == 'g';
}

Directions ColourDifferences(const Image<float>& half, const std::string& bayer) {
  Directions result{Image<float>(half.width(), half.height()), Image<float>(half.width(), half.height())};
  ParallelFor(0, half.height(), [&](int y) {
    const std::vector<float> line(half.row(y), half.row(y) + half.width());
    std::ranges::copy(ColourDifference(line, IsGreen(bayer, 0, y) ? 0 : 1), result.along_rows.row(y));
  });
  ParallelFor(0, half.width(), [&](int x) {
    std::vector<float> line(std::size_t(half.height()));
    for (int y = 0; y < half.height(); ++y) line[std::size_t(y)] = half(x, y);
    const std::vector<float> column = ColourDifference(line, IsGreen(bayer, x, 0) ? 0 : 1);
    for (int y = 0; y < half.height(); ++y) result.along_columns(x, y) = column[std::size_t(y)];
  });
  return result;
}

// Sum of |change over two places| in 5x5 px, centred.
Image<float> Roughness(const Image<float>& difference, int dx, int dy) {
  const int width = difference.width(), height = difference.height();
  const Image<float> padded = Pad(difference, 1);
  Image<float> change(width, height), sum(width, height), rough(width, height);
  ParallelFor(0, height, [&](int y) {
    for (int x = 0; x < width; ++x)
      change(x, y) = std::abs(padded(x + 1 + dx, y + 1 + dy) - padded(x + 1 - dx, y + 1 - dy));
  });
  ParallelFor(0, height, [&](int y) {
    for (int k = -2; k <= 2; ++k)
      for (int x = 0; x < width; ++x) sum(x, y) += change(x, Reflect(y + k, height));
    for (int x = 0; x < width; ++x)
      for (int k = -2; k <= 2; ++k) rough(x, y) += sum(Reflect(x + k, width), y);
  });
  return rough;
}

// Mean of the four one-sided colour differences, weighted by 1 / roughness^2 of each side.
float BestDifference(const Directions& differences, const Directions& roughness, int x, int y) {
  const int width = differences.along_rows.width(), height = differences.along_rows.height();
  float sum = 0, weights = 0;
  for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
    const Image<float>& difference = dx ? differences.along_rows : differences.along_columns;
    const Image<float>& rough = dx ? roughness.along_rows : roughness.along_columns;
    float mean = 0;
    for (int k = 0; k <= kFalloffReach; ++k)
      mean += kFalloff[std::size_t(k)] * difference(Reflect(x + k * dx, width), Reflect(y + k * dy, height));
    const float r = rough(Reflect(x + 2 * dx, width), Reflect(y + 2 * dy, height));
    const float weight = 1 / (r * r + kSmallestSquare);
    sum += weight * mean, weights += weight;
  }
  return sum / weights;
}

Image<float> FillGreen(const Image<float>& half, const std::string& bayer) {
  const Directions differences = ColourDifferences(half, bayer);
  const Directions roughness{Roughness(differences.along_rows, 1, 0),
                             Roughness(differences.along_columns, 0, 1)};
  Image<float> green = half;
  ParallelFor(0, half.height(), [&](int y) {
    for (int x = 0; x < half.width(); ++x)
      if (!IsGreen(bayer, x, y)) green(x, y) += BestDifference(differences, roughness, x, y);
  });
  return green;
}

// One angle's half-size Bayer picture in, red, green and blue of it out.
std::array<Image<float>, 3> FillBayer(const Image<float>& half, const std::string& bayer) {
  const Image<float> green = FillGreen(half, bayer);
  const auto fill = [&](char colour) {
    const int site = int(bayer.find(colour));
    return FillByResidual(half, green, site & 1, site >> 1);
  };
  return {fill('r'), green, fill('b')};
}

}  // namespace

std::array<Image<float>, 3> FillColours(const Image<float>& samples, const Layout& layout) {
  const Image<float> empty(samples.width(), samples.height());
  std::array<Image<float>, 3> colours = {empty, empty, empty};
  ParallelFor(0, 4, [&](int site) {
    const int site_x = site & 1, site_y = site >> 1;
    Image<float> half((samples.width() - site_x + 1) / 2, (samples.height() - site_y + 1) / 2);
    for (int y = 0; y < half.height(); ++y)
      for (int x = 0; x < half.width(); ++x) half(x, y) = samples(2 * x + site_x, 2 * y + site_y);
    const std::array<Image<float>, 3> filled = FillBayer(half, layout.bayer);
    for (std::size_t c = 0; c < 3; ++c)
      for (int y = 0; y < half.height(); ++y)
        for (int x = 0; x < half.width(); ++x) colours[c](2 * x + site_x, 2 * y + site_y) = filled[c](x, y);
  });
  return colours;
}

std::vector<AnglePlanes> InterpolateByColour(const Image<float>& samples, const Layout& layout,
                                             const MonoMethod& method) {
  CheckMosaicSize(samples);
  if (layout.bayer.empty()) return {method(samples, layout)};
  std::vector<AnglePlanes> colours;
  for (const Image<float>& colour : FillColours(samples, layout)) colours.push_back(method(colour, layout));
  return colours;
}

}  // namespace polarscan
