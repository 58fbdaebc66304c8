// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/response_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"

namespace polarscan {
namespace {

constexpr int kNeighbourhood = 32,
              kSmallestNeighbourhood = 8;  // px; even, so that all polarizer angles weigh the same
constexpr float kLowestGain = 0.5f, kHighestGain = 1.5f;
constexpr float kLowestDiattenuation = 0.5f, kHighestDiattenuation = 1.3f;
constexpr float kLargestTurn_deg = 15;

// Sums over all rectangles that begin at the top-left pixel, of gains and of their number.
struct Sums {
  Image<double> gain, count;

  double Mean(int x0, int y0, int x1, int y1) const {
    const auto over = [&](const Image<double>& s) { return s(x1, y1) - s(x0, y1) - s(x1, y0) + s(x0, y0); };
    const double n = over(count);
    return n > 0 ? over(gain) / n : 0;
  }
};

// Which pixels belong together.
using IsOfKind = std::function<bool(int x, int y)>;

Sums SumGains(const ResponseMap& map, const IsOfKind& of_kind) {
  Sums sums{Image<double>(map.width() + 1, map.height() + 1),
            Image<double>(map.width() + 1, map.height() + 1)};
  for (int y = 0; y < map.height(); ++y) {
    double gain = 0, count = 0;
    for (int x = 0; x < map.width(); ++x) {
      const Response response = map.At(x, y);
      if (!response.Defect() && of_kind(x, y)) gain += response.Gain(), count += 1;
      sums.gain(x + 1, y + 1) = sums.gain(x + 1, y) + gain;
      sums.count(x + 1, y + 1) = sums.count(x + 1, y) + count;
    }
  }
  return sums;
}

// The neighbourhood along one axis: inside of the picture, even at both ends, and with the pixel in its
// middle, so that light that rises evenly makes no difference; hence smaller near the border.
struct Range {
  int begin, end;
};
Range Neighbourhood(int i, int size) {
  const int place = i & ~1, room = std::min(place, size - 2 - place);
  const int half = std::clamp(room, kSmallestNeighbourhood / 2, kNeighbourhood / 2) & ~1;
  return {std::max(0, place - half), std::min(size, place + 2 + half)};
}

void DivideBy(ResponseMap& map, int x, int y, double gain) {
  const Response r = map.At(x, y);
  const float factor = gain > 0 ? float(1 / gain) : 0;
  map.Set(x, y, {r.a0 * factor, r.a1 * factor, r.a2 * factor});
}

void NormalizeKind(ResponseMap& map, const IsOfKind& of_kind, bool whole_picture) {
  const Sums sums = SumGains(map, of_kind);
  const int width = map.width(), height = map.height();
  const double mean = sums.Mean(0, 0, width, height);
  ParallelFor(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      if (!of_kind(x, y)) continue;
      const Range columns = Neighbourhood(x, width), rows = Neighbourhood(y, height);
      const double local = sums.Mean(columns.begin, rows.begin, columns.end, rows.end);
      DivideBy(map, x, y, whole_picture ? mean : local);
    }
  });
}

bool LooksLikeAPolarizer(const Response& response, int angle_deg) {
  const float gain = response.Gain(), diattenuation = response.Diattenuation();
  return gain > kLowestGain && gain < kHighestGain && diattenuation > kLowestDiattenuation &&
         diattenuation < kHighestDiattenuation &&
         std::abs(AngleErrorDeg(response, angle_deg)) < kLargestTurn_deg;
}

}  // namespace

ResponseFit::ResponseFit(int width, int height, const Layout& layout)
    : layout_(layout),
      r0_(width, height),
      r1_(width, height),
      r2_(width, height),
      squares_(width, height),
      clipped_(width, height) {
  normals_.fill(Eigen::Matrix3d::Zero());
}

void ResponseFit::Add(const Image<float>& readings, const Image<std::uint8_t>& clipped,
                      const Eigen::Vector3d& stokes, const Eigen::Vector4d& weights) {
  ++frames_;
  for (std::size_t i = 0; i < 4; ++i) normals_[i] += weights[Eigen::Index(i)] * stokes * stokes.transpose();
  weights_ += weights;
  const Eigen::Vector3f s = stokes.cast<float>();
  const Eigen::Vector4f w = weights.cast<float>();
  ParallelFor(0, readings.height(), [&](int y) {
    for (int x = 0; x < readings.width(); ++x) {
      const float value = readings(x, y), weighted = w[layout_.AngleAt(x, y) / 45] * value;
      r0_(x, y) += s[0] * weighted, r1_(x, y) += s[1] * weighted, r2_(x, y) += s[2] * weighted;
      squares_(x, y) += value * weighted;
      clipped_(x, y) |= clipped(x, y);
    }
  });
}

FittedResponses ResponseFit::Solve() const {
  if (frames_ < 4)
    throw Error("too few frames: a pixel's response has three unknowns", std::to_string(frames_) + " frames");
  std::array<Eigen::Matrix3d, 4> inverses;
  for (std::size_t i = 0; i < 4; ++i) inverses[i] = normals_[i].inverse();
  const Image<float> zero(r0_.width(), r0_.height());
  FittedResponses fitted{{zero, zero, zero}, zero, 0, 0};
  ParallelFor(0, zero.height(), [&](int y) {
    for (int x = 0; x < zero.width(); ++x) {
      const int angle = layout_.AngleAt(x, y) / 45;
      const Eigen::Vector3d r(r0_(x, y), r1_(x, y), r2_(x, y));
      const Eigen::Vector3d a = inverses[std::size_t(angle)] * r;
      const double rest =
          std::max(0.0, squares_(x, y) - a.dot(r)) / weights_[angle] * frames_ / (frames_ - 3);
      fitted.residual(x, y) =
          clipped_(x, y) ? std::numeric_limits<float>::infinity() : float(std::sqrt(rest));
      if (!clipped_(x, y)) fitted.responses.Set(x, y, {float(a[0]), float(a[1]), float(a[2])});
    }
  });
  fitted.clipped = std::size_t(std::ranges::count_if(clipped_.pixels(), [](auto c) { return c != 0; }));
  fitted.defect = fitted.clipped;
  return fitted;
}

void NormalizeGains(ResponseMap& responses, const Layout& layout, GainReference reference) {
  const bool by_angle = reference == GainReference::kNeighbourhoodOfAngle;
  for (const char colour : layout.bayer.empty() ? std::string("m") : std::string("rgb"))
    for (const int angle : by_angle ? std::vector<int>{0, 45, 90, 135} : std::vector<int>{-1}) {
      const IsOfKind of_kind = [&](int x, int y) {
        return layout.ColourAt(x, y) == colour && (angle < 0 || layout.AngleAt(x, y) == angle);
      };
      NormalizeKind(responses, of_kind, reference == GainReference::kPicture);
    }
}

std::size_t MarkDefects(ResponseMap& responses, const Layout& layout) {
  std::size_t defect = 0;
  for (int y = 0; y < responses.height(); ++y)
    for (int x = 0; x < responses.width(); ++x) {
      if (LooksLikeAPolarizer(responses.At(x, y), layout.AngleAt(x, y))) continue;
      responses.Set(x, y, {0, 0, 0});
      ++defect;
    }
  return defect;
}

}  // namespace polarscan
