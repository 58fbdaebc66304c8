// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/polarizer/polarizer_light.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numeric>

#include "core/error.h"
#include "core/statistics.h"
#include "demosaic/calibration/polarizer/factorization.h"
#include "demosaic/calibration/polarizer/light_refinement.h"
#include "demosaic/calibration/polarizer/sample_noise.h"
#include "demosaic/calibration/response.h"

namespace polarscan {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;

constexpr double kWorstAngle_deg = 3;    // between a given angle and what the frame shows
constexpr double kFewestAgreeing = 0.7;  // mean cosine between polarizers and layout (right: 0.95 and more)
constexpr double kUneven = 2;            // what a frame's readings miss the fit by, over the frames' median
constexpr double kSmallestLeft = 5e-4;   // of full scale: smaller misses are never uneven light
constexpr double kLargestKnownZero_deg = 10;  // by which a zero said to be known may be off

void RequireFrames(Eigen::Index frames, bool known) {
  const int fewest = known ? 5 : 6;
  if (frames < fewest)
    throw Error(fmt::format("too few frames: {} where at least {} are needed", frames, fewest),
                "the turned polarizer", "Take 12 to 36, evenly over half a turn or a whole one");
}

void CheckGivenAngles(const PolarizerKnowledge& known, Eigen::Index frames) {
  RequireFrames(frames, known.angles_deg.has_value());
  if (!known.angles_deg) return;
  Matrix3Xd light(3, frames);
  for (Eigen::Index k = 0; k < frames; ++k) {
    const double turn = 2 * (*known.angles_deg)[std::size_t(k)] * kRadPerDeg;
    light.col(k) << 1, std::cos(turn), std::sin(turn);
  }
  RequireSpread(ConditionOf(light));
}

// Mean of a pixel's polarizer against the layout's: its angle is twice the turn of all, its size 1 if they
// agree. mirrored: as if the polarizer's sense were the other one.
std::complex<double> CompareWithLayout(const PolarizerReadings& readings, const Eigen::MatrixX3d& responses,
                                       bool mirrored) {
  std::complex<double> sum = 0;
  double size = 0;
  for (Eigen::Index i = 0; i < responses.rows(); ++i) {
    const std::complex<double> pixel(responses(i, 1), (mirrored ? -1 : 1) * responses(i, 2));
    sum += pixel * std::polar(1.0, -2 * kRadPerDeg * readings.angles_deg[std::size_t(i)]);
    size += std::abs(pixel);
  }
  return size > 0 ? sum / size : 0;
}

void TurnLight(Matrix3Xd& stokes, double turn_rad) {
  Eigen::Matrix2d rotation;
  rotation << std::cos(turn_rad), -std::sin(turn_rad), std::sin(turn_rad), std::cos(turn_rad);
  stokes.bottomRows<2>() = (rotation * stokes.bottomRows<2>()).eval();
}

// Turns the light (and mirrors it, where its sense is not known) so that the pixels are right in the mean.
double FixZero(const PolarizerReadings& readings, const PolarizerKnowledge& known, Matrix3Xd& stokes) {
  const Eigen::MatrixX3d responses = FitResponses(readings, stokes);
  std::complex<double> agreement = CompareWithLayout(readings, responses, false);
  const std::complex<double> mirrored = CompareWithLayout(readings, responses, true);
  const bool mirror = std::abs(mirrored) > std::abs(agreement);
  if (mirror && known.angles_deg)
    throw Error(
        "the polarizer's angles run the other way round than the layout's", "the turned polarizer",
        "Angles count anticlockwise as displayed; or the layout is wrong: polarscan calibrate layout");
  if (mirror) stokes.row(2) = -stokes.row(2), agreement = mirrored;
  if (std::abs(agreement) < kFewestAgreeing)
    throw Error("the frames do not fit the layout", "the turned polarizer",
                "polarscan calibrate layout finds the right one");
  const double turn = std::arg(agreement), zero_deg = WrapHalfTurn(-turn / 2 / kRadPerDeg);
  if (!known.zero_is_known) TurnLight(stokes, -turn);
  if (known.zero_is_known && std::abs(zero_deg) > kLargestKnownZero_deg)
    throw Error(
        fmt::format("the sensor's polarizers are turned by {:.1f} degrees against the layout", -zero_deg),
        "the turned polarizer", "Is the zero of the given angles really the picture's +x?");
  return known.zero_is_known ? 0 : zero_deg;
}

std::string NameOf(const PolarizerKnowledge& known, int frame) {
  const bool has_name = std::size_t(frame) < known.frames.size();
  return has_name ? known.frames[std::size_t(frame)] : fmt::format("frame {}", frame + 1);
}

void CompareAngles(const PolarizerKnowledge& known, PolarizerLight& light) {
  for (std::size_t k = 0; known.angles_deg && k < light.angles_deg.size(); ++k) {
    const double given = (*known.angles_deg)[k];
    const auto is_this = [&](const FrameDoubt& doubt) { return std::size_t(doubt.frame) == k; };
    if (std::ranges::any_of(light.doubts, is_this)) continue;
    const double error = WrapHalfTurn(light.angles_deg[k] - light.zero_deg - given);
    light.largest_error_deg = std::max(light.largest_error_deg, std::abs(error));
    if (std::abs(error) > kWorstAngle_deg)
      throw Error(fmt::format("the given angle {:g} does not fit what the frame shows, {:.1f} degrees", given,
                              given + error),
                  NameOf(known, int(k)),
                  "Are the angles in the order of the frames' names? --angles unknown finds them");
  }
}

// What is known of some of the frames.
PolarizerKnowledge OfFrames(PolarizerKnowledge known, const std::vector<int>& frames) {
  std::vector<double> angles;
  for (const int frame : frames)
    if (known.angles_deg) angles.push_back((*known.angles_deg)[std::size_t(frame)]);
  if (known.angles_deg) known.angles_deg = std::move(angles);
  return known;
}

std::vector<int> AllFrames(Eigen::Index count) {
  std::vector<int> frames(std::size_t(count), 0);
  std::iota(frames.begin(), frames.end(), 0);
  return frames;
}

// The frames whose readings the same responses explain, in order; the others come as doubts.
std::vector<int> EvenFrames(const MatrixXd& gram, Eigen::Index pixels, std::vector<FrameDoubt>& doubts) {
  std::vector<int> even = AllFrames(gram.rows());
  std::vector<FrameDoubt> found;
  for (;;) {
    const Eigen::VectorXd left = LeftOutside(gram(even, even), pixels);
    const double usual = std::max(Median({left.begin(), left.end()}), kSmallestLeft * kSmallestLeft);
    Eigen::Index worst = 0;
    if (left.maxCoeff(&worst) < kUneven * kUneven * usual) break;
    if (int(found.size()) == MostDoubts(gram.rows()))
      return AllFrames(gram.rows());  // they are no exceptions
    found.push_back(
        {even[std::size_t(worst)], "",
         fmt::format("its light is uneven in another way than the others' (a reflection, a shadow?): its "
                     "readings miss what the others say of the pixels by {:.1f} times the usual deviation",
                     std::sqrt(left[worst] / usual)),
         true});
    even.erase(even.begin() + worst);
  }
  doubts = std::move(found);
  return even;
}

// Least squares: the light of all frames that pixels of such responses show.
Matrix3Xd LightBy(const PolarizerReadings& readings, const Eigen::MatrixX3d& responses) {
  const Matrix3d normal = responses.transpose() * responses;
  return normal.ldlt().solve((responses.cast<float>().transpose() * readings.light).cast<double>());
}

std::vector<double> AnglesOf(const Matrix3Xd& stokes) {
  std::vector<double> angles;
  for (Eigen::Index k = 0; k < stokes.cols(); ++k) {
    const double angle = std::atan2(stokes(2, k), stokes(1, k)) / 2 / kRadPerDeg;
    angles.push_back(angle < 0 ? angle + 180 : angle);
  }
  return angles;
}

}  // namespace

PolarizerLight FindPolarizerLight(const PolarizerReadings& readings, const PolarizerKnowledge& known) {
  CheckGivenAngles(known, readings.light.cols());
  PolarizerLight light;
  const MatrixXd gram = GramOf(readings);
  const std::vector<int> even = EvenFrames(gram, readings.light.rows(), light.doubts);
  const PolarizerReadings used{readings.light(Eigen::all, even), readings.angles_deg};
  const Matrix3Xd space = LightSpace(gram(even, even));
  const RefinedLight refined = RefineLight(space, OfFrames(known, even));
  for (const FrameDoubt& doubt : refined.doubts)
    light.doubts.push_back({even[std::size_t(doubt.frame)], "", doubt.words, false});
  for (FrameDoubt& doubt : light.doubts) doubt.name = NameOf(known, doubt.frame);
  Matrix3Xd stokes = refined.matrix * space;
  light.by_light = DeviationsByLight(refined.covariance, MeansByAngle(used, FitResponses(used, stokes)),
                                     known.zero_is_known);
  light.zero_deg = FixZero(used, known, stokes);
  stokes /= stokes.row(0).mean();
  const WeighedFit fit = WeighByNoise(used, stokes);
  light.by_noise = DeviationsByNoise(fit, stokes);
  light.stokes = LightBy(readings, FitResponses(used, stokes, fit.weights));
  light.stokes(Eigen::all, even) = stokes;
  light.weights = Eigen::Matrix4Xd::Zero(4, gram.rows());
  light.weights(Eigen::all, even) = fit.weights;
  light.condition = ConditionOf(stokes);
  RequireSpread(light.condition);
  light.angles_deg = AnglesOf(light.stokes);
  CompareAngles(known, light);
  return light;
}

}  // namespace polarscan
