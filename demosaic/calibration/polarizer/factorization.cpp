// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/polarizer/factorization.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

#include "core/error.h"
#include "demosaic/calibration/response.h"

namespace polarscan {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::RowVector3d;
using Eigen::Vector3d;

constexpr double kWorstCondition = 20;  // of the frames' angles; even ones have sqrt(2)

// The unit vector x with the smallest |equations x|. By the normal equations: it is only where the maximum-likelihood
// refinement begins, and they compile in a tenth of the time that a singular value decomposition takes.
Eigen::VectorXd LeastSquaresNull(const MatrixXd& equations) {
  const MatrixXd squares = equations.transpose() * equations;
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(squares).eigenvectors().col(0);
}

// The matrix (up to a positive scale) with matrix * space[k] ~ (1, p cos 2 angle, p sin 2 angle).
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
  const Eigen::VectorXd solution = LeastSquaresNull(equations);
  Matrix3d matrix;
  matrix << solution.segment<3>(0).transpose(), solution.segment<3>(3).transpose(),
      solution.segment<3>(6).transpose();
  return (matrix.row(0) * space).sum() < 0 ? Matrix3d(-matrix) : matrix;  // light is positive
}

// The quadratic form of the cone on which all frames' light lies, (+, -, -).
Matrix3d SolveCone(const Matrix3Xd& space) {
  MatrixXd equations(space.cols(), 6);
  for (Eigen::Index k = 0; k < space.cols(); ++k) {
    const Vector3d v = space.col(k).normalized();
    equations.row(k) << v[0] * v[0], v[1] * v[1], v[2] * v[2], 2 * v[0] * v[1], 2 * v[0] * v[2],
        2 * v[1] * v[2];
  }
  const Eigen::VectorXd q = LeastSquaresNull(equations);
  Matrix3d form;
  form << q[0], q[3], q[4], q[3], q[1], q[5], q[4], q[5], q[2];
  return form.determinant() > 0 ? form : Matrix3d(-form);
}

// The Lorentz boost after which the first component of light on the cone is as even as can be.
Matrix3d BoostToEvenBrightness(const Matrix3Xd& light) {
  const Vector3d even = Matrix3d(light * light.transpose()).ldlt().solve(Vector3d(light.rowwise().sum()));
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

}  // namespace

double ConditionOf(const Matrix3Xd& stokes) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(stokes * stokes.transpose());
  const Vector3d values = solver.eigenvalues();
  return values[0] > 1e-12 * values[2] ? std::sqrt(values[2] / values[0]) : 1e6;
}

void RequireSpread(double condition) {
  if (condition < kWorstCondition) return;
  throw Error(fmt::format("the polarizer's angles are too much alike (condition number {:.0f}, even angles "
                          "have 1.4, more than {:.0f} is refused)",
                          condition, kWorstCondition),
              "the turned polarizer", "Take frames evenly over half a turn or a whole one");
}

MatrixXd GramOf(const PolarizerReadings& readings) {
  return (readings.light.transpose() * readings.light).cast<double>();
}

Matrix3Xd LightSpace(const MatrixXd& gram) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(gram);
  const Eigen::Index last = gram.rows() - 1;
  const double first = solver.eigenvalues()[last], third = solver.eigenvalues()[last - 2];
  // Of responses and light together; the responses' share is sqrt(2).
  RequireSpread(third > 0 ? std::sqrt(first / third / 2) : 1e9);
  return solver.eigenvectors().rightCols(3).rowwise().reverse().transpose();
}

Eigen::VectorXd LeftOutside(const MatrixXd& gram, Eigen::Index pixels) {
  const Matrix3Xd space = LightSpace(gram);
  const MatrixXd outside = MatrixXd::Identity(gram.rows(), gram.rows()) - space.transpose() * space;
  const Eigen::ArrayXd squares = (outside * gram * outside).diagonal().array();
  return squares / (double(pixels) * outside.diagonal().array().max(1e-6));
}

Matrix3d LightByAlgebra(const Matrix3Xd& space, const PolarizerKnowledge& known) {
  return known.angles_deg ? SolveKnown(space, *known.angles_deg, known.degree)
                          : SolveUnknown(space, known.degree);
}

}  // namespace polarscan
