// SPDX-License-Identifier: Apache-2.0
#include "demosaic/methods/residual.h"

#include <algorithm>

#include "core/parallel.h"
#include "demosaic/bayer.h"
#include "demosaic/methods/guide.h"
#include "demosaic/methods/reflect.h"

namespace polarscan {
namespace {

constexpr int kWindowRadius = 2;  // of a window, in samples of one kind
constexpr float kWindowSize = (2 * kWindowRadius + 1) * (2 * kWindowRadius + 1);
constexpr int kHalo = 1 + 2 * kWindowRadius + 1;  // the Laplacian, windows twice, and one for good measure
constexpr int kBandHeight = 64;                   // px: its intermediates stay in the cache
constexpr float kSteepestFit = 2;                 // slope of a difference to the guide: noise may claim any
constexpr float kSmallestLaplacian = 1e-10f;      // squared, in units of full scale
constexpr float kSmallestMisfit = 1e-10f;         // the same

// Rows first ... last - 1 of the lattice of one sample of each 2x2 cell, with kHalo columns more on either
// side; beyond the picture it is reflected.
Image<float> TakeSites(const Image<float>& image, int site_x, int site_y, int first, int last) {
  const int count = (image.width() - site_x + 1) / 2;
  Image<float> sites(count + 2 * kHalo, last - first);
  for (int y = first; y < last; ++y) {
    const float* row = image.row(Reflect(2 * y + site_y, image.height()));
    float* out = sites.row(y - first) + kHalo;
    for (int x = 0; x < count; ++x) out[x] = row[2 * x + site_x];
    for (int i = 1; i <= kHalo; ++i) {
      out[-i] = row[Reflect(site_x - 2 * i, image.width())];
      out[count - 1 + i] = row[Reflect(2 * (count - 1 + i) + site_x, image.width())];
    }
  }
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

// The mean over the window around each pixel, in place. Beyond the border the nearest row and column count;
// that reaches only halos.
void AverageWindows(Image<float>& image) {
  static_assert(kWindowRadius == 2);
  const int width = image.width(), height = image.height();
  Image<float> sums(width + 2 * kWindowRadius, height);
  for (int y = 0; y < height; ++y) {
    const auto row = [&](int k) { return image.row(std::clamp(y + k, 0, height - 1)); };
    const float *a = row(-2), *b = row(-1), *c = row(0), *d = row(1), *e = row(2);
    float* out = sums.row(y) + kWindowRadius;
    for (int x = 0; x < width; ++x) out[x] = ((a[x] + e[x]) + (b[x] + d[x])) + c[x];
    out[-2] = out[-1] = out[0], out[width] = out[width + 1] = out[width - 1];
  }
  for (int y = 0; y < height; ++y) {
    const float* row = sums.row(y);
    float* out = image.row(y);
    for (int x = 0; x < width; ++x)
      out[x] = (((row[x] + row[x + 4]) + (row[x + 1] + row[x + 3])) + row[x + 2]) * (1 / kWindowSize);
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
    const float a = std::clamp(common.pixels()[i] / (bends.pixels()[i] + kSmallestLaplacian / kWindowSize),
                               -kSteepestFit, kSteepestFit);
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

// One row of sites with its halo, bilinearly in x: out[2 i + site_x] is site i itself.
void SpreadRow(const float* row, int site_x, int width, float* out) {
  const float* sites = row + kHalo;
  for (int i = 0; 2 * i + site_x < width; ++i) out[2 * i + site_x] = sites[i];
  const float* before = sites - site_x;  // of the first pixel between
  for (int i = 0; 2 * i + 1 - site_x < width; ++i)
    out[2 * i + 1 - site_x] = 0.5f * (before[i] + before[i + 1]);
}

// Row y of the picture from the lattice's rows above and below it; `first` is the lattice row that sites
// begins with.
void MeanOfRows(const Image<float>& sites, int first, int y, int site_y, std::vector<float>& out) {
  const int twice = y - site_y;
  const float *a = sites.row((twice >> 1) - first), *b = sites.row(((twice + 1) >> 1) - first);
  for (int x = 0; x < sites.width(); ++x) out[std::size_t(x)] = 0.5f * (a[x] + b[x]);
}

// Rows first ... last - 1 of the picture. They need the lattice rows around them, and those kHalo more.
void FillBand(const Image<float>& samples, const Image<float>& guide, int site_x, int site_y, int first,
              int last, Image<float>& filled) {
  const int begin = ((first - site_y) >> 1) - kHalo, end = ((last - site_y) >> 1) + 1 + kHalo;
  const Image<float> g = TakeSites(guide, site_x, site_y, begin, end);
  const Image<float> d = Pixelwise(TakeSites(samples, site_x, site_y, begin, end), g,
                                   [](float sample, float at) { return sample - at; });
  const Fit fit = FitWindows(g, d);
  Image<float> residual(g.width(), g.height());
  for (std::size_t i = 0; i < g.size(); ++i)
    residual.pixels()[i] = d.pixels()[i] - fit.slope.pixels()[i] * g.pixels()[i] - fit.offset.pixels()[i];
  const int width = samples.width();
  const std::size_t row_size = static_cast<std::size_t>(width);
  std::vector<float> sites(std::size_t(g.width())), slope(row_size), offset(row_size), rest(row_size);
  for (int y = first; y < last; ++y) {
    const auto spread = [&](const Image<float>& image, std::vector<float>& row) {
      MeanOfRows(image, begin, y, site_y, sites);
      SpreadRow(sites.data(), site_x, width, row.data());
    };
    spread(fit.slope, slope), spread(fit.offset, offset), spread(residual, rest);
    const float* at = guide.row(y);
    float* out = filled.row(y);
    for (std::size_t x = 0; x < row_size; ++x) out[x] = at[x] + slope[x] * at[x] + offset[x] + rest[x];
  }
}

}  // namespace

Image<float> FillByResidual(const Image<float>& samples, const Image<float>& guide, int site_x, int site_y) {
  Image<float> filled(samples.width(), samples.height());
  const int bands = (samples.height() + kBandHeight - 1) / kBandHeight;
  ParallelFor(0, bands, [&](int band) {
    FillBand(samples, guide, site_x, site_y, band * kBandHeight,
             std::min(samples.height(), (band + 1) * kBandHeight), filled);
  });
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
