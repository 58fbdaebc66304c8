// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/polarizer/polarizer_light.h"

#include <fmt/format.h>
#include <Eigen/Dense>

#include <cmath>
#include <complex>

#include "core/error.h"
#include "demosaic/calibration/response.h"

namespace polarscan {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::RowVector3d;
using Eigen::Vector3d;

constexpr double kWorstCondition = 20;   // of the frames' angles; even ones have sqrt(2)
constexpr double kWorstAngle_deg = 3;    // between a given angle and what the frame shows
constexpr double kFewestAgreeing = 0.7;  // mean cosine between polarizers and layout (right: 0.95 and more)
constexpr double kLargestKnownZero_deg = 10;  // by which a zero said to be known may be off

void RequireFrames(Eigen::Index frames, bool known) {
  const int fewest = known ? 5 : 6;
  if (frames < fewest)
    throw Error(fmt::format("too few frames: {} where at least {} are needed", frames, fewest),
                "the turned polarizer", "Take 12 to 36, evenly over half a turn or a whole one");
}

[[noreturn]] void ThrowAlike(double condition) {
  throw Error(fmt::format("the polarizer's angles are too much alike (condition number {:.0f}, even angles "
                          "have 1.4, more than {:.0f} is refused)",
                          condition, kWorstCondition),
              "the turned polarizer", "Take frames evenly over half a turn or a whole one");
}

double ConditionOf(const Matrix3Xd& stokes) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(stokes * stokes.transpose());
  const Vector3d values = solver.eigenvalues();
  return values[0] > 1e-12 * values[2] ? std::sqrt(values[2] / values[0]) : 1e6;
}

void CheckGivenAngles(const PolarizerKnowledge& known, Eigen::Index frames) {
  RequireFrames(frames, known.angles_deg.has_value());
  if (!known.angles_deg) return;
  Matrix3Xd light(3, frames);
  for (Eigen::Index k = 0; k < frames; ++k) {
    const double turn = 2 * (*known.angles_deg)[std::size_t(k)] * kRadPerDeg;
    light.col(k) << 1, std::cos(turn), std::sin(turn);
  }
  const double condition = ConditionOf(light);
  if (!(condition < kWorstCondition)) ThrowAlike(condition);
}

// Orthonormal 3 x K: the space of the frames' light.
Matrix3Xd LightSpace(const PolarizerReadings& readings) {
  const MatrixXd gram = (readings.light.transpose() * readings.light).cast<double>();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(gram);
  const Eigen::Index last = gram.rows() - 1;
  const double first = solver.eigenvalues()[last], third = solver.eigenvalues()[last - 2];
  // Of responses and light together; the responses' share is sqrt(2).
  const double condition = third > 0 ? std::sqrt(first / third / 2) : 1e9;
  if (condition > kWorstCondition) ThrowAlike(condition);
  return solver.eigenvectors().rightCols(3).rowwise().reverse().transpose();
}

// The matrix (up to scale) with matrix * space[k] ~ (1, p cos 2 angle, p sin 2 angle).
Matrix3d SolveKnown(const Matrix3Xd& space, const std::vector<double>& angles_deg, double degree) {
  const Eigen::Index frames = space.cols();
  MatrixXd equations = MatrixXd::Zero(2 * frames, 9);
  for (Eigen::Index k = 0; k < frames; ++k) {
    const double turn = 2 * angles_deg[std::size_t(k)] * kRadPerDeg;
    const RowVector3d v = space.col(k).transpose();
    equations.block<1, 3>(2 * k, 0) = -degree * std::cos(turn) * v;
    equations.block<1, 3>(2 * k, 3) = v;
    equations.block<1, 3>(2 * k + 1, 0) = -degree * std::sin(turn) * v;
    equations.block<1, 3>(2 * k + 1, 6) = v;
  }
  const Eigen::JacobiSVD<MatrixXd> svd(equations, Eigen::ComputeThinV);
  const Eigen::VectorXd solution = svd.matrixV().col(8);
  Matrix3d matrix;
  matrix << solution.segment<3>(0).transpose(), solution.segment<3>(3).transpose(),
      solution.segment<3>(6).transpose();
  return matrix;
}

// The quadratic form of the cone on which all frames' light lies, (+, -, -).
Matrix3d SolveCone(const Matrix3Xd& space) {
  MatrixXd equations(space.cols(), 6);
  for (Eigen::Index k = 0; k < space.cols(); ++k) {
    const Vector3d v = space.col(k).normalized();
    equations.row(k) << v[0] * v[0], v[1] * v[1], v[2] * v[2], 2 * v[0] * v[1], 2 * v[0] * v[2],
        2 * v[1] * v[2];
  }
  const Eigen::JacobiSVD<MatrixXd> svd(equations, Eigen::ComputeFullV);
  const Eigen::VectorXd q = svd.matrixV().col(5);
  Matrix3d form;
  form << q[0], q[3], q[4], q[3], q[1], q[5], q[4], q[5], q[2];
  return form.determinant() > 0 ? form : Matrix3d(-form);
}

// The Lorentz boost after which the first component of light on the cone is as even as can be.
Matrix3d BoostToEvenBrightness(const Matrix3Xd& light) {
  const Vector3d even = light.transpose().colPivHouseholderQr().solve(Eigen::VectorXd::Ones(light.cols()));
  const double norm2 = even[0] * even[0] - even[1] * even[1] - even[2] * even[2];
  if (even[0] <= 0 || norm2 <= 0) return Matrix3d::Identity();
  const Vector3d u = even / std::sqrt(norm2);
  const Eigen::Vector2d s = u.tail<2>();
  Matrix3d boost;
  boost(0, 0) = u[0];
  boost.block<1, 2>(0, 1) = s.transpose();
  boost.block<2, 1>(1, 0) = s;
  boost.block<2, 2>(1, 1) = Eigen::Matrix2d::Identity() + s * s.transpose() / (1 + u[0]);
  return boost;
}

Matrix3d SolveUnknown(const Matrix3Xd& space, double degree) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(SolveCone(space));
  const Vector3d values = solver.eigenvalues();  // rising
  if (!(values[1] < 0 && values[2] > 0))
    throw Error("the frames do not look like one linear polarizer that is turned", "the turned polarizer",
                "The light behind it must be even and the same in all frames, and the camera must not move");
  Matrix3d matrix;
  for (int i = 0; i < 3; ++i)
    matrix.row(i) = std::sqrt(std::abs(values[2 - i])) * solver.eigenvectors().col(2 - i).transpose();
  if ((matrix.row(0) * space).sum() < 0) matrix.row(0) = -matrix.row(0);
  matrix = BoostToEvenBrightness(matrix * space) * matrix;
  matrix.bottomRows<2>() *= degree;
  return matrix;
}

// Least squares: the responses of all pixels to this light.
Eigen::MatrixX3d FitResponses(const PolarizerReadings& readings, const Matrix3Xd& stokes) {
  const Matrix3d normal = stokes * stokes.transpose();
  const Eigen::MatrixX3d products = (readings.light * stokes.transpose().cast<float>()).cast<double>();
  return normal.ldlt().solve(products.transpose()).transpose();
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

void CompareAngles(const PolarizerKnowledge& known, PolarizerLight& light) {
  for (std::size_t k = 0; known.angles_deg && k < light.angles_deg.size(); ++k) {
    const double given = (*known.angles_deg)[k];
    const double error = WrapHalfTurn(light.angles_deg[k] - light.zero_deg - given);
    light.largest_error_deg = std::max(light.largest_error_deg, std::abs(error));
    if (std::abs(error) > kWorstAngle_deg)
      throw Error(fmt::format("the given angle {:g} does not fit what the frame shows, {:.1f} degrees", given,
                              given + error),
                  k < known.frames.size() ? known.frames[k] : fmt::format("frame {}", k + 1),
                  "Are the angles in the order of the frames' names? --angles unknown finds them");
  }
}

}  // namespace

PolarizerLight FindPolarizerLight(const PolarizerReadings& readings, const PolarizerKnowledge& known) {
  CheckGivenAngles(known, readings.light.cols());
  const Matrix3Xd space = LightSpace(readings);
  const Matrix3d matrix = known.angles_deg ? SolveKnown(space, *known.angles_deg, known.degree)
                                           : SolveUnknown(space, known.degree);
  PolarizerLight light;
  light.stokes = matrix * space;
  light.stokes /= light.stokes.row(0).mean();
  light.zero_deg = FixZero(readings, known, light.stokes);
  light.condition = ConditionOf(light.stokes);
  if (light.condition > kWorstCondition) ThrowAlike(light.condition);
  for (Eigen::Index k = 0; k < light.stokes.cols(); ++k) {
    const double angle = std::atan2(light.stokes(2, k), light.stokes(1, k)) / 2 / kRadPerDeg;
    light.angles_deg.push_back(angle < 0 ? angle + 180 : angle);
  }
  CompareAngles(known, light);
  return light;
}

}  // namespace polarscan
