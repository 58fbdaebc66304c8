// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/finding/background_cells.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "core/parallel.h"
#include "core/statistics.h"
#include "stereo/dense/masks/finding/noise_by_brightness.h"

namespace polarscan {
namespace {

using CellFlags = cv::Mat_<std::uint8_t>;

constexpr double kMostLikely = 1.2;                 // times the deviation of the stillest
constexpr double kStillestShare = 0.25;             // of the cells of a brightness: nothing moves before them
constexpr float kCellLikely = 5;                    // deviations
constexpr int kGrowthSteps = 40, kGrowthCells = 2;  // cells that a step of growth goes
constexpr double kNearlyAll = 0.9;                  // of the views

// How much a cell's light differs from view to view, in each of the planes.
class CellNoise {
 public:
  CellNoise(const std::vector<StokesCells>& views, float bright)
      : planes_{NoiseByBrightness(bright), NoiseByBrightness(bright), NoiseByBrightness(bright)} {
    const cv::Size size = views[0][0].size();
    std::vector<double> values(views.size());
    for (int y = 0; y < size.height; y += 2)
      for (int x = 0; x < size.width; x += 2) {
        float light = 0;
        for (std::size_t plane = 0; plane < 3; ++plane) {
          for (std::size_t i = 0; i < views.size(); ++i) values[i] = double(views[i][plane](y, x));
          const double middle = Median(values);
          if (plane == 0) light = float(middle);
          for (double& value : values) value = std::abs(value - middle);
          planes_[plane].Add(light, 1.4826 * Median(values));
        }
      }
    for (NoiseByBrightness& noise : planes_) noise.Learn(kStillestShare, kMostLikely);
  }

  bool Agree(const std::array<float, 3>& a, const std::array<float, 3>& b) const {
    for (std::size_t plane = 0; plane < 3; ++plane)
      if (std::abs(a[plane] - b[plane]) > kCellLikely * planes_[plane].At(a[0])) return false;
    return true;
  }

 private:
  std::array<NoiseByBrightness, 3> planes_;
};

class BackgroundSearch {
 public:
  BackgroundSearch(const std::vector<StokesCells>& views, float bright)
      : views_(views), noise_(views, bright), size_(views[0][0].size()), light_(std::size_t(size_.area())) {}

  std::vector<CellFlags> Find() {
    std::vector<std::size_t> all(views_.size());
    std::iota(all.begin(), all.end(), 0);
    ForCells([&](int x, int y) { Light(x, y) = MostCommon(all, x, y).value; });
    std::vector<CellFlags> background = Connected();
    for (int step = 0; step < kGrowthSteps; ++step) {
      if (!Grow(background)) break;
      background = Connected();
    }
    return background;
  }

 private:
  using Value = std::array<float, 3>;

  template <class Do>
  void ForCells(Do&& act) const {
    ParallelFor(0, size_.height, [&](int y) {
      for (int x = 0; x < size_.width; ++x) act(x, y);
    });
  }
  Value& Light(int x, int y) { return light_[std::size_t(y) * std::size_t(size_.width) + std::size_t(x)]; }
  Value At(std::size_t view, int x, int y) const {
    return {views_[view][0](y, x), views_[view][1](y, x), views_[view][2](y, x)};
  }
  // Of the views: fewer say nothing.
  int Few() const { return std::max(3, int(views_.size()) / 10); }

  struct Common {
    Value value{};
    int views = 0;
  };

  // The mean of those of the views' values that are like one of them, taken that most are like.
  Common MostCommon(const std::vector<std::size_t>& views, int x, int y) const {
    Common best;
    for (std::size_t a = 0; a < views.size() && 2 * best.views <= int(views.size()); ++a) {
      const Value value = At(views[a], x, y);
      Common found;
      for (const std::size_t i : views) {
        const Value other = At(i, x, y);
        if (!noise_.Agree(value, other)) continue;
        ++found.views;
        for (std::size_t k = 0; k < 3; ++k) found.value[k] += other[k];
      }
      if (found.views > best.views) best = found;
    }
    for (float& of_plane : best.value) of_plane /= float(std::max(1, best.views));
    return best;
  }

  // In each view what agrees with the background and hangs together with the border by more than a thread.
  std::vector<CellFlags> Connected() {
    std::vector<CellFlags> all(views_.size());
    ParallelFor(0, int(views_.size()), [&](int i) {
      CellFlags alike(size_), core;
      for (int y = 0; y < size_.height; ++y)
        for (int x = 0; x < size_.width; ++x)
          alike(y, x) = noise_.Agree(Light(x, y), At(std::size_t(i), x, y)) ? 255 : 0;
      const cv::Mat square = cv::Mat::ones(3, 3, CV_8U);
      cv::erode(alike, core, square, {-1, -1}, 1, cv::BORDER_REPLICATE);
      KeepAtBorder(core);
      cv::dilate(core, core, square);
      all[std::size_t(i)] = core & alike;
    });
    return all;
  }

  // Leaves the connected parts that touch the picture's border.
  static void KeepAtBorder(CellFlags& flags) {
    cv::Mat_<int> parts;
    std::vector<std::uint8_t> kept(std::size_t(cv::connectedComponents(flags, parts, 4, CV_32S)), 0);
    for (int y = 0; y < parts.rows; ++y)
      for (const int x : {0, parts.cols - 1}) kept[std::size_t(parts(y, x))] = 255;
    for (int x = 0; x < parts.cols; ++x)
      for (const int y : {0, parts.rows - 1}) kept[std::size_t(parts(y, x))] = 255;
    kept[0] = 0;  // not set
    for (int y = 0; y < parts.rows; ++y)
      for (int x = 0; x < parts.cols; ++x) flags(y, x) = kept[std::size_t(parts(y, x))];
  }

  // Takes what views have in common that have background next to a cell that is background in none or few.
  bool Grow(const std::vector<CellFlags>& background) {
    std::vector<CellFlags> near(views_.size());
    for (std::size_t i = 0; i < views_.size(); ++i)
      cv::dilate(background[i], near[i], cv::Mat::ones(2 * kGrowthCells + 1, 2 * kGrowthCells + 1, CV_8U));
    std::vector<std::uint8_t> changed(light_.size(), 0);
    ForCells([&](int x, int y) {
      const std::optional<Value> value = CommonNear(background, near, x, y);
      if (!value || noise_.Agree(*value, Light(x, y))) return;
      Light(x, y) = *value;
      changed[std::size_t(y) * std::size_t(size_.width) + std::size_t(x)] = 1;
    });
    return std::ranges::count(changed, 1) > 0;
  }

  std::optional<Value> CommonNear(const std::vector<CellFlags>& background,
                                  const std::vector<CellFlags>& near, int x, int y) const {
    std::vector<std::size_t> asked;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      if (background[i](y, x)) return {};
      if (near[i](y, x)) asked.push_back(i);
    }
    const Common common = MostCommon(asked, x, y);
    if (common.views < Few()) return {};
    std::size_t of_all = 0;
    for (std::size_t i = 0; i < views_.size(); ++i) of_all += noise_.Agree(common.value, At(i, x, y));
    if (double(of_all) > kNearlyAll * double(views_.size())) return {};
    return common.value;
  }

  const std::vector<StokesCells>& views_;
  CellNoise noise_;
  cv::Size size_;
  std::vector<Value> light_;  // the background's, as far as is known
};

}  // namespace

std::vector<CellFlags> BackgroundCells(const std::vector<StokesCells>& views, float bright) {
  return BackgroundSearch(views, bright).Find();
}

}  // namespace polarscan
