// SPDX-License-Identifier: Apache-2.0
#include "demosaic/bayer.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "demosaic/methods/bilinear.h"
#include "demosaic/methods/reflect.h"
#include "demosaic/methods/residual.h"

namespace polarscan {
namespace {

constexpr int kFalloffReach = 3;  // of the directional means, px of the half-size picture
constexpr int kLineReach = 5;     // half width of the regression along a line, px
constexpr float kSteepest =
    2;  // slope of one colour's difference to another: a few noisy samples may claim any
constexpr float kSmallestSquare = 1e-10f;
constexpr std::array<float, kFalloffReach + 1> kFalloff = {0.56f, 0.35f, 0.08f,
                                                           0.01f};  // Gaussian, sigma 1 px

// A line and what lies beyond its ends, reflected: at(i) for -kLineReach ... size - 1 + kLineReach.
class PaddedLine {
 public:
  explicit PaddedLine(const std::vector<float>& line) : values_(line.size() + 2 * kLineReach) {
    PadRow(line.data(), int(line.size()), kLineReach, values_.data());
  }
  const float* at(int i) const { return values_.data() + kLineReach + i; }

 private:
  std::vector<float> values_;
};

// The kind at places `first`, first + 2, ..., linearly interpolated to all places.
std::vector<float> Linear(const std::vector<float>& samples, int first) {
  const PaddedLine padded(samples);
  std::vector<float> line = samples;
  for (int i = 1 - first; i < int(samples.size()); i += 2)
    line[std::size_t(i)] = 0.5f * (*padded.at(i - 1) + *padded.at(i + 1));
  return line;
}

// The samples of one kind (every second place from `first` on) spread along the line by residual
// interpolation: a guide + b within +- 5 px by least squares, then the rest linearly.
std::vector<float> FillLine(const std::vector<float>& samples, const std::vector<float>& guide, int first) {
  const int size = int(samples.size());
  const PaddedLine g(guide), s(samples);
  std::vector<float> tentative(samples.size()), filled(samples.size());
  for (int i = 0; i < size; ++i) {
    float n = 0, u_sum = 0, v_sum = 0, uu = 0, uv = 0;
    const float origin = *g.at(i);
    const int reach = kLineReach - ((i - first + kLineReach) & 1);  // the nearest and the last of the kind
    for (int k = i - reach; k <= i + reach; k += 2) {
      const float u = *g.at(k) - origin, v = *s.at(k) - *g.at(k);
      ++n, u_sum += u, v_sum += v, uu += u * u, uv += u * v;
    }
    const float slope = std::clamp((uv - u_sum * v_sum / n) / (uu - u_sum * u_sum / n + kSmallestSquare),
                                   -kSteepest, kSteepest);
    tentative[std::size_t(i)] = origin + (v_sum - slope * u_sum) / n;
  }
  const PaddedLine t(tentative);
  const auto rest = [&](int k) { return *s.at(k) - *t.at(k); };
  for (int i = 0; i < size; ++i)
    filled[std::size_t(i)] =
        tentative[std::size_t(i)] + (((i - first) & 1) == 0 ? rest(i) : 0.5f * (rest(i - 1) + rest(i + 1)));
  return filled;
}

// Green minus the line's other colour at every place of a line; green at even places if first_green is 0.
std::vector<float> ColourDifference(const std::vector<float>& samples, int first_green) {
  if (samples.size() < 2) return std::vector<float>(samples.size());
  const std::vector<float> green = FillLine(samples, Linear(samples, 1 - first_green), first_green);
  const std::vector<float> other = FillLine(samples, Linear(samples, first_green), 1 - first_green);
  std::vector<float> difference(samples.size());
  for (std::size_t i = 0; i < difference.size(); ++i) difference[i] = green[i] - other[i];
  return difference;
}

Image<float> Transposed(const Image<float>& image) {
  constexpr int kTile = 32;
  Image<float> transposed(image.height(), image.width());
  ParallelFor(0, (image.height() + kTile - 1) / kTile, [&](int tile) {
    for (int x = 0; x < image.width(); ++x)
      for (int y = tile * kTile; y < std::min(image.height(), (tile + 1) * kTile); ++y)
        transposed(y, x) = image(x, y);
  });
  return transposed;
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
  const Image<float> turned = Transposed(half);
  Image<float> columns(turned.width(), turned.height());
  ParallelFor(0, turned.height(), [&](int x) {
    const std::vector<float> line(turned.row(x), turned.row(x) + turned.width());
    std::ranges::copy(ColourDifference(line, IsGreen(bayer, x, 0) ? 0 : 1), columns.row(x));
  });
  result.along_columns = Transposed(columns);
  return result;
}

// Sum of |change over two places| in 5x5 px, centred.
Image<float> Roughness(const Image<float>& difference, int dx, int dy) {
  const int width = difference.width(), height = difference.height();
  const Image<float> padded = Pad(difference, 1);
  Image<float> change(width, height), rough(width, height);
  ParallelFor(0, height, [&](int y) {
    for (int x = 0; x < width; ++x)
      change(x, y) = std::abs(padded(x + 1 + dx, y + 1 + dy) - padded(x + 1 - dx, y + 1 - dy));
  });
  const Image<float> changes = Pad(change, 2);
  ParallelFor(0, height, [&](int y) {
    std::vector<float> sum(std::size_t(changes.width()));
    for (int k = 0; k < 5; ++k)
      for (std::size_t x = 0; x < sum.size(); ++x) sum[x] += changes.row(y + k)[x];
    for (int x = 0; x < width; ++x) {
      const float* at = sum.data() + x;
      rough(x, y) = at[0] + at[1] + at[2] + at[3] + at[4];
    }
  });
  return rough;
}

// Mean of the four one-sided colour differences, weighted by 1 / roughness^2 of each side. All padded by
// kFalloffReach.
float BestDifference(const Directions& differences, const Directions& roughness, int x, int y) {
  const std::ptrdiff_t width = differences.along_rows.width();
  float sum = 0, weights = 0;
  for (const bool row : {true, false}) {
    const float* difference =
        (row ? differences.along_rows : differences.along_columns).row(y + kFalloffReach) + x + kFalloffReach;
    const float* rough =
        (row ? roughness.along_rows : roughness.along_columns).row(y + kFalloffReach) + x + kFalloffReach;
    for (const std::ptrdiff_t step : {row ? -1 : -width, row ? 1 : width}) {
      float mean = 0;
      for (int k = 0; k <= kFalloffReach; ++k) mean += kFalloff[std::size_t(k)] * difference[k * step];
      const float r = rough[2 * step], weight = 1 / (r * r + kSmallestSquare);
      sum += weight * mean, weights += weight;
    }
  }
  return sum / weights;
}

Image<float> FillGreen(const Image<float>& half, const std::string& bayer) {
  const auto pad = [](const Image<float>& image) { return Pad(image, kFalloffReach); };
  const Directions plain = ColourDifferences(half, bayer);
  const Directions differences{pad(plain.along_rows), pad(plain.along_columns)};
  const Directions roughness{pad(Roughness(plain.along_rows, 1, 0)),
                             pad(Roughness(plain.along_columns, 0, 1))};
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
