// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/finding/still_background.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/parallel.h"
#include "core/statistics.h"
#include "stereo/dense/masks/finding/background_cells.h"
#include "stereo/dense/masks/finding/specks.h"
#include "stereo/dense/masks/outline_cut.h"

namespace polarscan {
namespace {

constexpr std::size_t kMostAsked = 40;  // views
constexpr int kCellsAcross = 640;       // of the longer side, about
constexpr int kSamplesAcross = 600;     // of the noise
constexpr double kBrightShare = 0.995;  // of S0
constexpr float kDim = 0.05f;           // of it: darker cells do not tell how bright a view is
constexpr double kDifferenceBlur = 1;   // px
constexpr float kHiddenDeviations = 5;  // deviations
constexpr double kOutlinePx = 3;        // how far the outline may move to a step of the light

using FloatMatrix = cv::Mat_<float>;
using ByteMatrix = cv::Mat_<std::uint8_t>;

FloatMatrix AsMatrix(const Image<float>& image) {
  return FloatMatrix(image.height(), image.width(), const_cast<float*>(image.row(0)));
}
std::array<const Image<float>*, 3> PlanesOf(const StokesImage& light) {
  return {&light.s0, &light.s1, &light.s2};
}
std::array<Image<float>*, 3> PlanesOf(StokesImage& light) { return {&light.s0, &light.s1, &light.s2}; }

StokesCells ToCells(const StokesImage& light, cv::Size size) {
  StokesCells cells;
  for (std::size_t k = 0; k < 3; ++k)
    cv::resize(AsMatrix(*PlanesOf(light)[k]), cells[k], size, 0, 0, cv::INTER_AREA);
  return cells;
}

// Evenly chosen.
std::vector<int> Some(const std::vector<int>& views) {
  const std::size_t count = std::min(views.size(), kMostAsked);
  std::vector<int> some;
  for (std::size_t k = 0; k < count; ++k) some.push_back(views[k * views.size() / count]);
  return some;
}

float BrightOf(const FloatMatrix& s0) {
  return std::max(1e-6f, Quantile(std::vector<float>(s0.begin(), s0.end()), kBrightShare));
}

FloatMatrix MedianOf(const std::vector<StokesCells>& views) {
  FloatMatrix middle(views[0][0].size());
  ParallelFor(0, middle.rows, [&](int y) {
    for (int x = 0; x < middle.cols; ++x) {
      std::vector<double> values;
      for (const StokesCells& view : views) values.push_back(double(view[0](y, x)));
      middle(y, x) = float(Median(std::move(values)));
    }
  });
  return middle;
}

// How much brighter a view is: a lamp that flickers, another exposure.
float Gain(const FloatMatrix& s0, const FloatMatrix& usual, float bright) {
  std::vector<double> ratios;
  for (int y = 0; y < s0.rows; ++y)
    for (int x = 0; x < s0.cols; ++x)
      if (usual(y, x) > kDim * bright) ratios.push_back(double(s0(y, x) / usual(y, x)));
  return ratios.empty() ? 1 : float(Median(std::move(ratios)));
}

// S0, S1 and S2 of 0, without noise.
StokesImage Dark(int width, int height) {
  const Image<float> zero(width, height, 0.f);
  return {zero, zero, zero, {}};
}

cv::Size CellsOf(const Pinhole& camera) {
  const int cell = std::max(1, std::max(camera.width, camera.height) / kCellsAcross);
  return {std::max(1, camera.width / cell), std::max(1, camera.height / cell)};
}

}  // namespace

StillBackground::StillBackground(const Workspace& workspace, const std::vector<int>& views,
                                 Progress& progress) {
  const std::vector<int> asked = Some(views);
  const Pinhole& camera = workspace.views[std::size_t(asked[0])].camera;
  std::vector<StokesCells> cells(asked.size());
  progress.Begin("still background", 2 * asked.size());
  ParallelFor(0, int(asked.size()), [&](int i) {
    progress.Check();
    cells[std::size_t(i)] = ToCells(ReadViewLight(workspace, asked[std::size_t(i)]), CellsOf(camera));
    progress.Advance();
  });
  usual_ = MedianOf(cells);
  bright_ = BrightOf(usual_);
  for (StokesCells& view : cells) {
    const float gain = Gain(view[0], usual_, bright_);
    for (FloatMatrix& plane : view) plane /= gain;
  }
  const std::vector<ByteMatrix> background = BackgroundCells(cells, bright_);

  light_ = Dark(camera.width, camera.height);
  known_ = Image<std::uint8_t>(camera.width, camera.height, 0);
  Image<float> count(camera.width, camera.height, 0.f);
  for (std::size_t i = 0; i < asked.size(); ++i) {
    progress.Check();
    Add(ReadViewLight(workspace, asked[i]), background[i], count);
    progress.Advance();
  }
  for (std::size_t i = 0; i < count.size(); ++i) {
    if (count.pixels()[i] == 0) continue;
    known_.pixels()[i] = 1;
    for (Image<float>* plane : PlanesOf(light_)) plane->pixels()[i] /= count.pixels()[i];
  }
}

// A view's light, where its cells show the background; count: how many views a pixel has got so far.
void StillBackground::Add(const StokesImage& light, const ByteMatrix& background, Image<float>& count) {
  const float gain = Gain(ToCells(light, usual_.size())[0], usual_, bright_);
  const int width = count.width(), height = count.height();
  ParallelFor(0, height, [&](int y) {
    const std::uint8_t* cells = background[std::min(y * background.rows / height, background.rows - 1)];
    for (int x = 0; x < width; ++x) {
      if (!cells[std::min(x * background.cols / width, background.cols - 1)]) continue;
      for (std::size_t k = 0; k < 3; ++k) (*PlanesOf(light_)[k])(x, y) += (*PlanesOf(light)[k])(x, y) / gain;
      ++count(x, y);
    }
  });
}

Image<std::uint8_t> StillBackground::ObjectIn(const StokesImage& light, StokesImage* difference) const {
  const int width = known_.width(), height = known_.height();
  const float gain = Gain(ToCells(light, usual_.size())[0], usual_, bright_);
  StokesImage unlike = Dark(width, height);
  std::array<FloatMatrix, 3> smooth;
  for (std::size_t k = 0; k < 3; ++k) {
    Image<float>& plane = *PlanesOf(unlike)[k];
    for (std::size_t i = 0; i < plane.size(); ++i)
      plane.pixels()[i] = PlanesOf(light)[k]->pixels()[i] / gain - PlanesOf(light_)[k]->pixels()[i];
    cv::GaussianBlur(AsMatrix(plane), smooth[k], {}, kDifferenceBlur);
    for (float& value : plane.pixels()) value = std::abs(value);
  }
  Image<std::uint8_t> mask = HiddenBy(smooth);
  DropSpecks(mask);
  mask = CutAlongSteps(LightSteps(unlike), SignedDistance(mask), kOutlinePx);
  DropSpecks(mask);
  if (difference) *difference = std::move(unlike);
  return mask;
}

// Pixels whose light differs by more than noise does, and those of which nothing is known.
Image<std::uint8_t> StillBackground::HiddenBy(const std::array<FloatMatrix, 3>& differences) const {
  const Noise noise = Measure(differences);
  Image<std::uint8_t> mask(known_.width(), known_.height());
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x) {
      bool hidden = known_(x, y) == 0;
      for (std::size_t k = 0; k < 3 && !hidden; ++k)
        hidden = std::abs(differences[k](y, x)) > kHiddenDeviations * noise[k].At(light_.s0(x, y));
      mask(x, y) = hidden ? 255 : 0;
    }
  return mask;
}

// The median of what a view differs by is the noise's as long as the object hides less than half.
StillBackground::Noise StillBackground::Measure(const std::array<FloatMatrix, 3>& differences) const {
  Noise noise{NoiseByBrightness(bright_), NoiseByBrightness(bright_), NoiseByBrightness(bright_)};
  const int step = std::max(1, std::max(known_.width(), known_.height()) / kSamplesAcross);
  for (std::size_t k = 0; k < 3; ++k) {
    for (int y = 0; y < known_.height(); y += step)
      for (int x = 0; x < known_.width(); x += step)
        if (known_(x, y)) noise[k].Add(light_.s0(x, y), std::abs(double(differences[k](y, x))));
    noise[k].Learn(0.5, 1.4826);
  }
  return noise;
}

}  // namespace polarscan
