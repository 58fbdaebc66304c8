// SPDX-License-Identifier: Apache-2.0
#include "demosaic/residual.h"

#include <algorithm>

#include "core/parallel.h"
#include "demosaic/bayer.h"
#include "demosaic/guide.h"
#include "demosaic/reflect.h"

namespace polarscan {
namespace {

constexpr int kWindowRadius = 2;  // of a window, in samples of one kind
constexpr float kWindowSize = (2 * kWindowRadius + 1) * (2 * kWindowRadius + 1);
constexpr float kSmallestLaplacian = 1e-10f;  // squared, in units of full scale
constexpr float kSmallestMisfit = 1e-10f;     // the same

// One sample of each 2x2 cell, as a picture of its own.
Image<float> TakeSites(const Image<float>& image, int site_x, int site_y) {
  Image<float> sites((image.width() - site_x + 1) / 2, (image.height() - site_y + 1) / 2);
  for (int y = 0; y < sites.height(); ++y)
    for (int x = 0; x < sites.width(); ++x) sites(x, y) = image(2 * x + site_x, 2 * y + site_y);
  return sites;
}

Image<float> Laplacian(const Image<float>& image) {
  const Image<float> padded = Pad(image, 1);
  Image<float> laplacian(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y) {
    const float *up = padded.row(y) + 1, *here = padded.row(y + 1) + 1, *down = padded.row(y + 2) + 1;
    float* out = laplacian.row(y);
    for (int x = 0; x < image.width(); ++x)
      out[x] = 4 * here[x] - (here[x - 1] + here[x + 1]) - (up[x] + down[x]);
  }
  return laplacian;
}

// The mean over the window around each pixel, in place.
void AverageWindows(Image<float>& image) {
  const int width = image.width(), height = image.height();
  Image<float> sums(width + 2 * kWindowRadius, height);
  std::vector<float> column(static_cast<std::size_t>(width));
  for (int y = 0; y < height; ++y) {
    std::fill(column.begin(), column.end(), 0.f);
    for (int k = -kWindowRadius; k <= kWindowRadius; ++k) {
      const float* row = image.row(Reflect(y + k, height));
      for (int x = 0; x < width; ++x) column[std::size_t(x)] += row[x];
    }
    PadRow(column.data(), width, kWindowRadius, sums.row(y));
  }
  for (int y = 0; y < height; ++y) {
    const float* row = sums.row(y);
    float* out = image.row(y);
    for (int x = 0; x < width; ++x)
      out[x] = (((row[x] + row[x + 4]) + (row[x + 1] + row[x + 3])) + row[x + 2]) / kWindowSize;
  }
}

template <class F>
Image<float> Pixelwise(const Image<float>& a, const Image<float>& b, F&& f) {
  Image<float> result(a.width(), a.height());
  for (std::size_t i = 0; i < a.size(); ++i) result.pixels()[i] = f(a.pixels()[i], b.pixels()[i]);
  return result;
}

Image<float> WindowMean(Image<float> image) {
  AverageWindows(image);
  return image;
}

Image<float> WindowMeanOfProduct(const Image<float>& a, const Image<float>& b) {
  return WindowMean(Pixelwise(a, b, [](float u, float v) { return u * v; }));
}

// difference = slope guide + offset, at each sample's site.
struct Fit {
  Image<float> slope, offset;
};

// The difference of samples and guide is fitted, not the samples: their variance is small against their
// squares.
Fit FitWindows(const Image<float>& guide, const Image<float>& difference) {
  const Image<float> bend = Laplacian(guide);
  const Image<float> bends = WindowMeanOfProduct(bend, bend),
                     common = WindowMeanOfProduct(bend, Laplacian(difference));
  const Image<float> g = WindowMean(guide), d = WindowMean(difference),
                     gg = WindowMeanOfProduct(guide, guide), gd = WindowMeanOfProduct(guide, difference),
                     dd = WindowMeanOfProduct(difference, difference);
  Fit fit{Image<float>(g.width(), g.height()), Image<float>(g.width(), g.height())};
  Image<float> weight(g.width(), g.height());
  for (std::size_t i = 0; i < g.size(); ++i) {
    const float mg = g.pixels()[i], md = d.pixels()[i];
    const float a = common.pixels()[i] / (bends.pixels()[i] + kSmallestLaplacian / kWindowSize);
    const float misfit =
        (dd.pixels()[i] - md * md) - 2 * a * (gd.pixels()[i] - mg * md) + a * a * (gg.pixels()[i] - mg * mg);
    const float w = 1 / (std::max(misfit, 0.f) + kSmallestMisfit);
    weight.pixels()[i] = w, fit.slope.pixels()[i] = w * a, fit.offset.pixels()[i] = w * (md - a * mg);
  }
  AverageWindows(weight), AverageWindows(fit.slope), AverageWindows(fit.offset);
  for (std::size_t i = 0; i < g.size(); ++i) {
    fit.slope.pixels()[i] /= weight.pixels()[i];
    fit.offset.pixels()[i] /= weight.pixels()[i];
  }
  return fit;
}

// One row of sites, bilinearly in x: out[2 i + site_x] is the site itself.
void SpreadRow(const float* sites, int count, int site_x, int width, float* out) {
  for (int i = 0; i < count; ++i) out[2 * i + site_x] = sites[i];
  if (site_x == 1) out[0] = out[1];
  if (2 * count - 1 + site_x < width) out[width - 1] = out[width - 2];
  for (int x = site_x + 1; x + 1 < width; x += 2) out[x] = 0.5f * (out[x - 1] + out[x + 1]);
}

// The rows of sites above and below a pixel row, mean of two; beyond the border the one there is.
void MeanOfRows(const Image<float>& sites, int y, int site_y, std::vector<float>& out) {
  const int last = sites.height() - 1, twice = y - site_y;
  const float *a = sites.row(std::clamp(twice >> 1, 0, last)),
              *b = sites.row(std::clamp((twice + 1) >> 1, 0, last));
  for (int x = 0; x < sites.width(); ++x) out[std::size_t(x)] = 0.5f * (a[x] + b[x]);
}

}  // namespace

Image<float> FillByResidual(const Image<float>& samples, const Image<float>& guide, int site_x, int site_y) {
  const Image<float> g = TakeSites(guide, site_x, site_y);
  const Image<float> d =
      Pixelwise(TakeSites(samples, site_x, site_y), g, [](float sample, float at) { return sample - at; });
  const Fit fit = FitWindows(g, d);
  Image<float> residual(g.width(), g.height());
  for (std::size_t i = 0; i < g.size(); ++i)
    residual.pixels()[i] = d.pixels()[i] - fit.slope.pixels()[i] * g.pixels()[i] - fit.offset.pixels()[i];
  const int width = samples.width(), count = g.width();
  Image<float> filled(width, samples.height());
  const std::size_t row_size = static_cast<std::size_t>(width);
  std::vector<float> sites(row_size), slope(row_size), offset(row_size), rest(row_size);
  for (int y = 0; y < samples.height(); ++y) {
    const auto spread = [&](const Image<float>& image, std::vector<float>& row) {
      MeanOfRows(image, y, site_y, sites);
      SpreadRow(sites.data(), count, site_x, width, row.data());
    };
    spread(fit.slope, slope), spread(fit.offset, offset), spread(residual, rest);
    const float* at = guide.row(y);
    float* out = filled.row(y);
    for (int x = 0; x < width; ++x) {
      const std::size_t i = static_cast<std::size_t>(x);
      out[x] = at[x] + slope[i] * at[x] + offset[i] + rest[i];
    }
  }
  return filled;
}

AnglePlanes FillAnglesByResidual(const Image<float>& samples, const Layout& layout,
                                 const Image<float>& guide) {
  AnglePlanes planes;
  ParallelFor(0, 4, [&](int site) {
    planes[std::size_t(layout.angles_deg[std::size_t(site)] / 45)] =
        FillByResidual(samples, guide, site & 1, site >> 1);
  });
  return planes;
}

std::vector<AnglePlanes> InterpolateEari(const Image<float>& samples, const Layout& layout) {
  return InterpolateByColour(samples, layout, [](const Image<float>& mono, const Layout& angles) {
    return FillAnglesByResidual(mono, angles, EdgeAwareGuide(mono));
  });
}

}  // namespace polarscan
