// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/outline_steps.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/statistics.h"

namespace polarscan {
namespace {

constexpr double kBlur = 2;           // px: of the distance, whose slope is the outline's normal
constexpr double kLeastSlope = 0.5;   // of it, where there is a direction
constexpr double kBrightest = 0.995;  // of S0: 1
constexpr float kDark = 1e-3f;        // of it: below, the root is not asked
constexpr int kNearMode = 1;          // px from the mode that belong to it
constexpr double kLeastOffset = 1.6;  // px
constexpr double kMostShare = 0.4,
                 kTimesShare =
                     2;  // share of all offsets that is near the mode, and that times the share near 0

cv::Mat Zeros(const Image<std::uint8_t>& mask, bool of_object) {
  cv::Mat zeros(mask.height(), mask.width(), CV_8U);
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x) zeros.at<std::uint8_t>(y, x) = (mask(x, y) != 0) != of_object;
  return zeros;
}

// Distance of each pixel to the nearest one of the object, or of what is not object.
cv::Mat DistanceTo(const Image<std::uint8_t>& mask, bool object) {
  cv::Mat distance;
  cv::distanceTransform(Zeros(mask, object), distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  return distance;
}

Image<float> Blurred(const Image<float>& image, double sigma) {
  Image<float> blurred(image.width(), image.height());
  const cv::Mat from(image.height(), image.width(), CV_32F, const_cast<float*>(image.row(0)));
  cv::Mat to(image.height(), image.width(), CV_32F, blurred.row(0));
  cv::GaussianBlur(from, to, {}, sigma);
  return blurred;
}

// Share of the offsets within kNearMode of `centre`.
double ShareNear(const std::vector<float>& offsets, double centre) {
  const auto near =
      std::ranges::count_if(offsets, [&](float o) { return std::abs(o - centre) <= kNearMode; });
  return double(near) / double(std::max<std::size_t>(1, offsets.size()));
}

}  // namespace

LightSteps::LightSteps(const StokesImage& light) {
  std::vector<float> sorted(light.s0.pixels().begin(), light.s0.pixels().end());
  const float full = std::max(float(Quantile(sorted, kBrightest)), 1e-6f);
  for (Image<float>& plane : planes_) plane = Image<float>(light.s0.width(), light.s0.height());
  for (std::size_t i = 0; i < light.s0.size(); ++i) {
    const float root = std::sqrt(std::max(light.s0.pixels()[i] / full, 0.f) + kDark);
    planes_[0].pixels()[i] = root;
    planes_[1].pixels()[i] = light.s1.pixels()[i] / full / (2 * root);
    planes_[2].pixels()[i] = light.s2.pixels()[i] / full / (2 * root);
  }
}

double LightSteps::Across(const Eigen::Vector2d& at, const Eigen::Vector2d& direction, int reach) const {
  double square = 0;
  for (const Image<float>& plane : planes_) {
    double step = 0;
    for (int k = 0; k < reach; ++k) {
      const Eigen::Vector2d far = at + (k + 0.5) * direction, near = at - (k + 0.5) * direction;
      const auto a = Bilinear(plane, far.x(), far.y()), b = Bilinear(plane, near.x(), near.y());
      if (!a || !b) return 0;
      step += double(*a) - double(*b);
    }
    square += step * step / (reach * reach);
  }
  return std::sqrt(square);
}

double LightSteps::Between(int x, int y, int other_x, int other_y) const {
  double square = 0;
  for (const Image<float>& plane : planes_) {
    const double step = double(plane(x, y)) - double(plane(other_x, other_y));
    square += step * step;
  }
  return std::sqrt(square);
}

Image<float> SignedDistance(const Image<std::uint8_t>& mask) {
  const cv::Mat to_object = DistanceTo(mask, true), to_background = DistanceTo(mask, false);
  Image<float> distance(mask.width(), mask.height());
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x)
      distance(x, y) = mask(x, y) ? 0.5f - to_background.at<float>(y, x) : to_object.at<float>(y, x) - 0.5f;
  return distance;
}

std::vector<OutlinePlace> OutlinePlaces(const Image<std::uint8_t>& mask, int most, double clear_px) {
  const Image<float> distance = SignedDistance(mask), smooth = Blurred(distance, kBlur);
  const int clear = std::max(2, int(std::ceil(clear_px)));
  std::vector<OutlinePlace> all;
  for (int y = clear; y < mask.height() - clear; ++y)
    for (int x = clear; x < mask.width() - clear; ++x) {
      if (!mask(x, y) || distance(x, y) < -1) continue;
      const Eigen::Vector2d slope((smooth(x + 1, y) - smooth(x - 1, y)) / 2.0,
                                  (smooth(x, y + 1) - smooth(x, y - 1)) / 2.0);
      if (slope.norm() < kLeastSlope) continue;
      const Eigen::Vector2d out = slope.normalized();
      all.push_back({Eigen::Vector2d(x + 0.5, y + 0.5) - double(distance(x, y)) * out, out});
    }
  std::vector<OutlinePlace> places;
  const std::size_t count = std::min(all.size(), std::size_t(most));
  for (std::size_t k = 0; k < count; ++k) places.push_back(all[k * all.size() / count]);
  return places;
}

std::vector<float> StepOffsets(const LightSteps& light, const std::vector<OutlinePlace>& places,
                               int reach_px) {
  const int mean_px = std::clamp(reach_px / 6, 2, 5);
  std::vector<float> offsets;
  for (const OutlinePlace& place : places) {
    double largest = 0;
    int best = 0;
    for (int offset = -reach_px; offset <= reach_px; ++offset) {
      const double step = light.Across(place.at + offset * place.out, place.out, mean_px);
      if (step > largest) largest = step, best = offset;
    }
    if (largest > 0) offsets.push_back(float(best));
  }
  return offsets;
}

double StepAround(const LightSteps& light, const OutlinePlace& place) {
  double largest = 0;
  for (int offset = -kStepAround; offset <= kStepAround; ++offset)
    largest = std::max(largest, light.Across(place.at + offset * place.out, place.out, kStepAround));
  return largest;
}

double SystematicOffset(const std::vector<float>& offsets, int reach_px) {
  int mode = 0;
  for (int offset = -reach_px; offset <= reach_px; ++offset)
    if (ShareNear(offsets, offset) > ShareNear(offsets, mode)) mode = offset;
  double sum = 0;
  int count = 0;
  for (const float offset : offsets)
    if (std::abs(offset - mode) <= kNearMode) sum += offset, ++count;
  const double centre = count ? sum / count : 0;
  const double share = ShareNear(offsets, mode);
  return std::abs(centre) >= kLeastOffset && share >= kMostShare &&
                 share >= kTimesShare * ShareNear(offsets, 0)
             ? centre
             : 0;
}

}  // namespace polarscan
