// SPDX-License-Identifier: Apache-2.0
#include "demosaic/doubts.h"

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "core/statistics.h"

namespace polarscan {
namespace {

constexpr double kSurely = 4, kLit = 8;  // standard deviations
constexpr double kRounding = 1.05;       // a degree of 1 comes out so
constexpr std::size_t kMostAsked = 200'000;

}  // namespace

ViewDoubts DoubtsOf(const PolarView& view, const Image<std::uint8_t>& mask) {
  const StokesImage& stokes = view.stokes;
  const std::size_t step = 1 + stokes.s0.size() / kMostAsked;
  std::size_t all = 0, below = 0, lit = 0, impossible = 0, clipped = 0;
  std::vector<double> imbalances;
  for (std::size_t i = 0; i < stokes.s0.size(); i += step) {
    if (!mask.empty() && !mask.pixels()[i]) continue;
    ++all;
    const double s0 = double(stokes.s0.pixels()[i]), noise = double(stokes.noise.pixels()[i]);
    if (!std::isfinite(noise)) {  // what was no number has become 0
      ++clipped;
      below += s0 <= 0;
      continue;
    }
    const double sigma = stokes.s0_noise * noise;
    below += s0 < -kSurely * sigma;
    if (s0 <= kLit * sigma) continue;
    ++lit;
    const double polarized = std::hypot(double(stokes.s1.pixels()[i]), double(stokes.s2.pixels()[i]));
    impossible += polarized > kRounding * s0 + kSurely * std::numbers::sqrt2 * noise;
    if (!view.redundancy.empty()) imbalances.push_back(double(view.redundancy.pixels()[i]) / s0);
  }
  ViewDoubts doubts;
  if (all > 0)
    doubts.without_light = double(below) / double(all), doubts.clipped = double(clipped) / double(all);
  if (lit > 0) doubts.impossible = double(impossible) / double(lit);
  doubts.imbalance = std::abs(Quantile(std::move(imbalances), 0.5));
  return doubts;
}

}  // namespace polarscan
