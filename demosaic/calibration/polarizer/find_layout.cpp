// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/polarizer/find_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "demosaic/calibration/response.h"

namespace polarscan {
namespace {

constexpr std::size_t kFewestLayoutFrames = 4;
constexpr double kLargestStep_deg = 80, kSmallestStep_deg = 0.5, kSmallestTurn_deg = 60;
constexpr double kLargestFirstError_deg = 20;
constexpr double kMostClippedLayout = 0.05;  // share of a frame's samples

// Means of a place over those of the cell, so that a lamp that drifts does not matter.
std::vector<CellMeans> Normalized(std::vector<CellMeans> frames) {
  for (CellMeans& cell : frames) {
    const double sum = cell[0] + cell[1] + cell[2] + cell[3];
    for (double& value : cell) value *= 4 / sum;
  }
  return frames;
}

// How much the sum of two places changes with the polarizer's angle.
double Unevenness(const std::vector<CellMeans>& frames, std::size_t p, std::size_t q) {
  double sum = 0, squares = 0;
  for (const CellMeans& cell : frames) {
    const double value = cell[p] + cell[q];
    sum += value, squares += value * value;
  }
  const double n = double(frames.size());
  return std::max(0.0, squares / n - (sum / n) * (sum / n));
}

// The place that is 90 degrees from place 0. The other two are a pair as well, with the same unevenness.
std::size_t PartnerOfFirst(const std::vector<CellMeans>& frames) {
  std::array<double, 4> unevenness{std::numeric_limits<double>::infinity()};
  for (std::size_t q = 1; q < 4; ++q) unevenness[q] = Unevenness(frames, 0, q);
  const auto best = std::size_t(std::ranges::min_element(unevenness) - unevenness.begin());
  for (std::size_t q = 1; q < 4; ++q)
    if (q != best && unevenness[q] < 4 * unevenness[best] + 1e-6)
      throw Error("the four places of the cell do not behave as polarizers of 0, 45, 90 and 135 degrees",
                  "the turned polarizer",
                  "Is there one linear polarizer in front of even light, and does it turn?");
  return best;
}

// Angles of the polarizer with place p at 0, its partner at 90, r at 45 and its partner at 135 degrees.
std::vector<double> Angles(const std::vector<CellMeans>& frames, const std::array<std::size_t, 4>& places) {
  std::vector<double> angles;
  for (const CellMeans& cell : frames)
    angles.push_back(std::atan2(cell[places[1]] - cell[places[3]], cell[places[0]] - cell[places[2]]) / 2 /
                     kRadPerDeg);
  return angles;
}

// From the first to the last frame; throws Error if the steps are not all in one sense.
double TotalTurn(const std::vector<double>& angles) {
  double turn = 0;
  int forward = 0, backward = 0;
  for (std::size_t k = 1; k < angles.size(); ++k) {
    const double step = WrapHalfTurn(angles[k] - angles[k - 1]);
    if (std::abs(step) > kLargestStep_deg)
      throw Error(
          fmt::format(
              "from frame {} to {} the polarizer turned by more than {} degrees, so its sense cannot be seen",
              k, k + 1, kLargestStep_deg),
          "the turned polarizer", "Take smaller steps, 15 to 45 degrees");
    forward += step > kSmallestStep_deg, backward += step < -kSmallestStep_deg;
    turn += step;
  }
  if (forward > 0 && backward > 0)
    throw Error("the polarizer turned to and fro", "the turned polarizer",
                "Turn it in one sense; the frames' order is that of their names");
  if (std::abs(turn) < kSmallestTurn_deg)
    throw Error(fmt::format("the polarizer turned by {:.0f} degrees only", std::abs(turn)),
                "the turned polarizer", "Turn it by half a turn or more");
  return turn;
}

}  // namespace

FoundLayout FindLayout(const std::vector<CellMeans>& given, double first_deg, bool anticlockwise) {
  if (given.size() < kFewestLayoutFrames)
    throw Error(
        fmt::format("too few frames: {} where at least {} are needed", given.size(), kFewestLayoutFrames),
        "the turned polarizer", "Take one every 15 to 45 degrees over half a turn or more");
  const std::vector<CellMeans> frames = Normalized(given);
  const std::size_t partner = PartnerOfFirst(frames);
  std::array<std::size_t, 2> others{};
  for (std::size_t q = 1, n = 0; q < 4; ++q)
    if (q != partner) others[n++] = q;
  std::array<std::size_t, 4> places = {0, others[0], partner, others[1]};
  if ((TotalTurn(Angles(frames, places)) > 0) != anticlockwise) std::swap(places[1], places[3]);

  FoundLayout found;
  std::vector<double> angles = Angles(frames, places);
  found.turn_deg = TotalTurn(angles);
  // So far place 0 counts as 0 degrees. All move together, in steps of 45.
  const double steps = std::round(WrapHalfTurn(first_deg - angles[0]) / 45);
  for (std::size_t i = 0; i < 4; ++i)
    found.layout.angles_deg[places[i]] = ((45 * int(i) + 45 * int(steps)) % 180 + 180) % 180;
  for (const double angle : angles) {
    const double turned = std::fmod(angle + 45 * steps + 360, 180);
    found.angles_deg.push_back(turned);
  }
  found.first_error_deg = WrapHalfTurn(found.angles_deg[0] - first_deg);
  if (std::abs(found.first_error_deg) > kLargestFirstError_deg)
    throw Error(
        fmt::format("the first frame lies {:.0f} degrees from every angle that fits, so the layout's zero "
                    "is not clear",
                    found.first_error_deg),
        "the turned polarizer", "Let the first frame's polarizer be horizontal, or say its --first-angle");
  return found;
}

std::vector<CellMeans> MeanCells(const CalibrationFrames& frames, const Sensor& sensor, Progress& progress) {
  std::vector<CellMeans> means;
  progress.Begin("the cell's places", frames.names.size(), "frame");
  for (int k = 0; k < frames.size(); ++k) {
    progress.Check();
    const Image<float> counts = frames.counts(k);
    RequireExposed(Clipped(counts, sensor), kMostClippedLayout, frames.names[std::size_t(k)]);
    CellMeans cell{};
    const int width = counts.width() & ~1, height = counts.height() & ~1;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        cell[std::size_t((y & 1) * 2 + (x & 1))] += counts(x, y) - sensor.black_dn;
    for (double& value : cell) value /= double(width) * height / 4;
    means.push_back(cell);
    progress.Advance();
  }
  return means;
}

}  // namespace polarscan
