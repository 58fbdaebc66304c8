// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/pieces.h"

#include <algorithm>

#include "core/statistics.h"
#include "stereo/dense/masks/outline_steps.h"

namespace polarscan {
namespace {

constexpr double kThin = 1.5;    // px: half of the thickness of what is no piece
constexpr double kLoose = 2;     // px: a hull that lies farther out tells of no piece
constexpr double kSlack = 0.75;  // quantile of how far the hull lies outside of the mask's outline

Image<std::uint8_t> Where(const Image<float>& distance, double inside_of) {
  Image<std::uint8_t> set(distance.width(), distance.height());
  for (std::size_t i = 0; i < set.size(); ++i)
    set.pixels()[i] = double(distance.pixels()[i]) < inside_of ? 255 : 0;
  return set;
}

// Without what is thinner than 2 radius.
Image<std::uint8_t> Opened(const Image<std::uint8_t>& set, double radius) {
  return Where(SignedDistance(Where(SignedDistance(set), -radius)), radius);
}

Image<std::uint8_t> Less(const Image<std::uint8_t>& set, const Image<std::uint8_t>& other) {
  Image<std::uint8_t> rest = set;
  for (std::size_t i = 0; i < rest.size(); ++i)
    if (other.pixels()[i]) rest.pixels()[i] = 0;
  return rest;
}

// Where the hull usually ends outside of the mask, px.
double UsualSlack(const Image<std::uint8_t>& own, const Image<float>& hull) {
  std::vector<float> slacks;
  const Image<float> distance = SignedDistance(own);
  for (std::size_t i = 0; i < own.size(); ++i)
    if (own.pixels()[i] && distance.pixels()[i] > -1) slacks.push_back(-hull.pixels()[i]);
  return std::max(0.0, double(Quantile(slacks, kSlack)));
}

void AddPieces(Image<std::uint8_t> set, bool gap, std::vector<Piece>& pieces) {
  for (int y = 0; y < set.height(); ++y)
    for (int x = 0; x < set.width(); ++x) {
      if (!set(x, y)) continue;
      Piece piece{gap, {{x, y}}};
      set(x, y) = 0;
      for (std::size_t k = 0; k < piece.pixels.size(); ++k)
        for (const auto& [dx, dy] : {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
          const Eigen::Vector2i at = piece.pixels[k] + Eigen::Vector2i(dx, dy);
          if (!set.Contains(at.x(), at.y()) || !set(at.x(), at.y())) continue;
          set(at.x(), at.y()) = 0;
          piece.pixels.push_back(at);
        }
      pieces.push_back(std::move(piece));
    }
}

}  // namespace

Dispute DisputedPieces(const HullVote& vote) {
  Dispute dispute;
  if (vote.own.empty()) return dispute;
  const Image<float> hull = SignedDistance(vote.others);
  dispute.slack = UsualSlack(vote.own, hull);
  if (dispute.slack > kLoose) return dispute;
  AddPieces(Opened(Less(Where(hull, -dispute.slack), vote.own), kThin), true, dispute.pieces);
  AddPieces(Opened(Less(vote.own, Where(hull, 1)), kThin), false, dispute.pieces);
  return dispute;
}

}  // namespace polarscan
