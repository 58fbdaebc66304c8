// SPDX-License-Identifier: Apache-2.0
#include "board/corners.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace polarscan {
namespace {

constexpr double kBlackShare = 0.01, kWhiteShare = 0.98;  // of the pixels, where black and white are taken
constexpr int kLeastRadius_px = 2, kMostRadius_px = 12;
constexpr double kWindowShare = 0.12;  // of a square's shortest side, as it shows: the window's radius
constexpr double kAgreement = 0.2;     // of the same: most that two markers may differ about a corner
constexpr double kMostMove = 0.4, kMostMove_px = 0.8;  // to the saddle, in windows, and px
constexpr double kProbe = 0.065;         // of a square: from a corner into the white ring around a marker
constexpr double kLeastContrast = 0.45;  // between the four squares at a corner, of white less black nearby

// Eight bits in square-root coding, which keeps dark parts.
Image<std::uint8_t> ToGrey(const Image<float>& s0, bool mirrored) {
  std::vector<float> values;
  for (std::size_t i = 0; i < s0.size(); i += 7) values.push_back(s0.pixels()[i]);
  const auto at = [&](double share) {
    const auto nth = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
    std::ranges::nth_element(values, nth);
    return *nth;
  };
  const float black = at(kBlackShare), range = std::max(at(kWhiteShare) - black, 1e-12f);
  Image<std::uint8_t> grey(s0.width(), s0.height());
  for (int y = 0; y < s0.height(); ++y)
    for (int x = 0; x < s0.width(); ++x) {
      const float value = s0(mirrored ? s0.width() - 1 - x : x, y);
      grey(x, y) = std::uint8_t(255 * std::sqrt(std::clamp((value - black) / range, 0.0f, 1.0f)) + 0.5f);
    }
  return grey;
}

// picture_from_board plane, by a marker's four corners (direct linear transformation with h33 = 1). x, y in
// squares from the square's upper left.
Eigen::Matrix3d HomographyOf(const FoundMarker& marker) {
  constexpr double kLow = (1 - Board::kMarkerShare) / 2, kHigh = 1 - kLow;
  constexpr std::array<std::array<double, 2>, 4> kPlaces = {
      {{kLow, kLow}, {kHigh, kLow}, {kHigh, kHigh}, {kLow, kHigh}}};
  Eigen::Matrix<double, 8, 8> a;
  Eigen::Matrix<double, 8, 1> b;
  for (int i = 0; i < 4; ++i) {
    const double x = kPlaces[std::size_t(i)][0], y = kPlaces[std::size_t(i)][1];
    const Eigen::Vector2d& p = marker.corners[std::size_t(i)];
    a.row(2 * i) << x, y, 1, 0, 0, 0, -x * p.x(), -y * p.x();
    a.row(2 * i + 1) << 0, 0, 0, x, y, 1, -x * p.y(), -y * p.y();
    b.segment<2>(2 * i) = p;
  }
  const Eigen::Matrix<double, 8, 1> h = a.partialPivLu().solve(b);
  Eigen::Matrix3d homography;
  homography << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1;
  return homography;
}

// How long the marker's shortest side shows its square's, px.
double ShortestSide(const FoundMarker& marker) {
  double shortest = 1e300;
  for (std::size_t i = 0; i < 4; ++i)
    shortest = std::min(shortest, (marker.corners[i] - marker.corners[(i + 1) % 4]).norm());
  return shortest / Board::kMarkerShare;
}

// What the markers around a corner say of it.
struct Prediction {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero(), first = Eigen::Vector2d::Zero();
  double apart = 0, side = 1e300;  // px
  int markers = 0;
  Eigen::Matrix2d axes = Eigen::Matrix2d::Zero();  // px that a square measures here, along rows and columns
};

// By corner.
std::map<int, Prediction> PredictCorners(const MarkersSeen& seen, const Board& board) {
  std::map<int, const FoundMarker*> by_id;
  for (const FoundMarker& marker : seen.markers) by_id[marker.id] = &marker;
  std::map<int, Prediction> predictions;
  for (const MarkerSquare& square : MarkerSquares(board)) {
    const auto found = by_id.find(square.id);
    if (found == by_id.end()) continue;
    const Eigen::Matrix3d homography = HomographyOf(*found->second);
    for (const auto& [x, y] : {std::pair(0, 0), std::pair(1, 0), std::pair(1, 1), std::pair(0, 1)}) {
      const int column = square.column + x - 1, row = square.row + y - 1;
      if (column < 0 || row < 0 || column >= board.columns - 1 || row >= board.rows - 1) continue;
      Prediction& p = predictions[row * (board.columns - 1) + column];
      const Eigen::Vector2d at = (homography * Eigen::Vector3d(x, y, 1)).hnormalized();
      if (p.markers++ == 0) {
        p.first = at;
        p.axes.col(0) = ((homography * Eigen::Vector3d(x + 0.1, y, 1)).hnormalized() - at) / 0.1;
        p.axes.col(1) = ((homography * Eigen::Vector3d(x, y + 0.1, 1)).hnormalized() - at) / 0.1;
      }
      p.sum += at;
      p.apart = std::max(p.apart, (at - p.first).norm());
      p.side = std::min(p.side, ShortestSide(*found->second));
    }
  }
  return predictions;
}

// Whether the four squares at a corner are black and white in turn: what hides a part of it, or the edge of a
// shadow, makes them otherwise. corner: Board::Corner.
bool IsCheckered(const Image<float>& s0, const Board& board, int corner, const Prediction& p,
                 const Eigen::Vector2d& at) {
  float least_white = 1e30f, most_white = -1e30f, least_black = 1e30f, most_black = -1e30f;
  for (const auto& [x, y] : {std::pair(-1, -1), std::pair(1, -1), std::pair(-1, 1), std::pair(1, 1)}) {
    const Eigen::Vector2d place = at + p.axes * (kProbe * Eigen::Vector2d(x, y));
    const auto value = Bilinear(s0, place.x(), place.y());
    if (!value) return false;
    const int column = corner % (board.columns - 1) + (x + 1) / 2,
              row = corner / (board.columns - 1) + (y + 1) / 2;
    if ((column + row) % 2 == 1)
      least_white = std::min(least_white, *value), most_white = std::max(most_white, *value);
    else
      least_black = std::min(least_black, *value), most_black = std::max(most_black, *value);
  }
  return least_white - most_black > kLeastContrast * (most_white - least_black);
}

}  // namespace

MarkersSeen SeeMarkers(const Image<float>& s0, bool mirrored) {
  MarkersSeen seen;
  if (s0.empty()) return seen;
  const std::vector<FoundMarker> found = FindMarkers(ToGrey(s0, mirrored));
  for (std::size_t i = 0; i < found.size(); ++i) {
    const bool before = i > 0 && found[i - 1].id == found[i].id;
    const bool after = i + 1 < found.size() && found[i + 1].id == found[i].id;
    if (after && !before) seen.twice.push_back(found[i].id);
    if (!before && !after) seen.markers.push_back(found[i]);
  }
  return seen;
}

std::vector<SeenCorner> FindBoardCorners(const Image<float>& s0, const MarkersSeen& seen,
                                         const Board& board) {
  std::vector<int> corners, radius_px;
  std::vector<Eigen::Vector2d> expected;
  const std::map<int, Prediction> predictions = PredictCorners(seen, board);
  for (const auto& [corner, p] : predictions) {
    if (p.apart > kAgreement * p.side) continue;
    const Eigen::Vector2d at = p.sum / p.markers;
    const int radius = std::clamp(int(kWindowShare * p.side), kLeastRadius_px, kMostRadius_px);
    const Eigen::Vector2d far = at.array() + radius + 2;
    if (at.minCoeff() < radius + 2 || far.x() > s0.width() || far.y() > s0.height()) continue;
    corners.push_back(corner), radius_px.push_back(radius), expected.push_back(at);
  }
  std::vector<Eigen::Vector2d> refined = expected;
  RefineCorners(s0, radius_px, refined);
  std::vector<SeenCorner> found;
  for (std::size_t i = 0; i < corners.size(); ++i)
    if ((refined[i] - expected[i]).norm() < kMostMove * radius_px[i] + kMostMove_px &&
        IsCheckered(s0, board, corners[i], predictions.at(corners[i]), refined[i]))
      found.push_back({corners[i], refined[i]});
  return found;
}

}  // namespace polarscan
