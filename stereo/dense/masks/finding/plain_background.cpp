// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/finding/plain_background.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/statistics.h"
#include "stereo/dense/masks/finding/specks.h"
#include "stereo/dense/masks/outline_cut.h"

namespace polarscan {
namespace {

constexpr double kPictureBlur = 1;         // px
constexpr double kBorderShare = 0.02;      // of the shorter side: the width of what is taken as background
constexpr int kLeastBorder = 3;            // px
constexpr double kBrightestLight = 0.995;  // of S0: 1
constexpr double kLeastDeviation = 2e-3;   // of it: rounding of pictures of 8 bits
constexpr double kMostDeviation = 0.03;    // of it: more is no plain background
constexpr double kPlainShare = 0.8;        // share of the border that must be
constexpr double kLikely = 5;              // deviations
constexpr int kFits = 5;                   // to what the last one explains
constexpr double kCutPx = 3;               // how far the outline may move to a step of the light
constexpr double kLeastObject = 5e-4, kMostObject = 0.9;  // of the picture

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Plane = cv::Mat_<float>;

// The monomials of x and y, from -1 to 1 over the picture.
Vector6d Monomials(int x, int y, int width, int height) {
  const double u = (2 * x + 1.0) / width - 1, v = (2 * y + 1.0) / height - 1;
  return (Vector6d() << 1, u, v, u * u, u * v, v * v).finished();
}

Plane Smooth(const Image<float>& image, double scale) {
  const Plane from(image.height(), image.width(), const_cast<float*>(image.row(0)));
  Plane smooth;
  cv::GaussianBlur(from * scale, smooth, {}, kPictureBlur);
  return smooth;
}

// A plane's background.
struct Background {
  Vector6d surface = Vector6d::Zero();
  double deviation = 0;

  double Miss(const Plane& plane, int x, int y) const {
    return std::abs(double(plane(y, x)) - surface.dot(Monomials(x, y, plane.cols, plane.rows))) / deviation;
  }
};

std::vector<cv::Point> Border(int width, int height) {
  const int wide = std::max(kLeastBorder, int(kBorderShare * std::min(width, height)));
  std::vector<cv::Point> border;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (std::min({x, y, width - 1 - x, height - 1 - y}) < wide) border.emplace_back(x, y);
  return border;
}

// Through the places of the border that it explains, in turns: at first all of them.
Background FitBackground(const Plane& plane, const std::vector<cv::Point>& border) {
  Background background{Vector6d::Zero(), 1e9};
  for (int fit = 0; fit < kFits; ++fit) {
    Eigen::Matrix<double, 6, 6> squares = 1e-9 * Eigen::Matrix<double, 6, 6>::Identity();
    Vector6d right = Vector6d::Zero();
    for (const cv::Point& at : border) {
      if (background.Miss(plane, at.x, at.y) > kLikely) continue;
      const Vector6d m = Monomials(at.x, at.y, plane.cols, plane.rows);
      squares += m * m.transpose(), right += double(plane(at)) * m;
    }
    background = {squares.ldlt().solve(right), 1};
    std::vector<double> misses;
    for (const cv::Point& at : border) misses.push_back(background.Miss(plane, at.x, at.y));
    background.deviation = std::max(1.4826 * Median(std::move(misses)), kLeastDeviation);
  }
  return background;
}

// S0, S1, S2 before their backgrounds.
struct BorderFit {
  std::array<Plane, 3> planes;
  std::array<Background, 3> backgrounds;

  bool StandsOut(int x, int y) const {
    for (std::size_t i = 0; i < planes.size(); ++i)
      if (backgrounds[i].Miss(planes[i], x, y) > kLikely) return true;
    return false;
  }
  bool IsPlain(const std::vector<cv::Point>& border) const {
    for (const Background& background : backgrounds)
      if (background.deviation > kMostDeviation) return false;
    const auto out =
        std::ranges::count_if(border, [&](const cv::Point& at) { return StandsOut(at.x, at.y); });
    return double(out) <= (1 - kPlainShare) * double(border.size());
  }
};

}  // namespace

std::optional<Image<std::uint8_t>> ObjectBeforePlainBackground(const StokesImage& light) {
  std::vector<float> values(light.s0.pixels().begin(), light.s0.pixels().end());
  const double full = double(Quantile(std::move(values), kBrightestLight));
  if (!(full > 0)) return std::nullopt;
  BorderFit fit{{Smooth(light.s0, 1 / full), Smooth(light.s1, 1 / full), Smooth(light.s2, 1 / full)}, {}};
  const int width = light.s0.width(), height = light.s0.height();
  const std::vector<cv::Point> border = Border(width, height);
  for (std::size_t i = 0; i < 3; ++i) fit.backgrounds[i] = FitBackground(fit.planes[i], border);
  if (!fit.IsPlain(border)) return std::nullopt;
  Image<std::uint8_t> mask(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) mask(x, y) = fit.StandsOut(x, y) ? 255 : 0;
  const auto object = double(std::ranges::count(mask.pixels(), 255));
  if (object < kLeastObject * width * height || object > kMostObject * width * height) return std::nullopt;
  DropSpecks(mask);
  return CutAlongSteps(LightSteps(light), SignedDistance(mask), kCutPx);
}

}  // namespace polarscan
