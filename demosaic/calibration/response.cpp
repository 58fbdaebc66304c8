// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/response.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "demosaic/stokes.h"

namespace polarscan {

float Response::Diattenuation() const { return Defect() ? 0 : std::hypot(a1, a2) / a0; }

float Response::AngleRad() const { return AngleOfPolarization(a1, a2); }

Response MakeResponse(double gain, double diattenuation, double angle_rad) {
  const double polarized = gain * diattenuation / 2;
  return {float(gain / 2), float(polarized * std::cos(2 * angle_rad)),
          float(polarized * std::sin(2 * angle_rad))};
}

Response IdealResponse(int angle_deg) {
  static const std::array<Response, 4> ideal = {MakeResponse(1, 1, 0), MakeResponse(1, 1, 45 * kRadPerDeg),
                                                MakeResponse(1, 1, 90 * kRadPerDeg),
                                                MakeResponse(1, 1, 135 * kRadPerDeg)};
  return ideal[std::size_t(angle_deg / 45)];
}

ResponseMap IdealResponses(int width, int height, const Layout& layout) {
  const Image<float> zero(width, height);
  ResponseMap map{zero, zero, zero};
  ParallelFor(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) map.Set(x, y, IdealResponse(layout.AngleAt(x, y)));
  });
  return map;
}

double WrapHalfTurn(double degrees) { return degrees - 180 * std::ceil((degrees - 90) / 180); }

float AngleErrorDeg(const Response& response, int angle_deg) {
  return float(WrapHalfTurn(response.AngleRad() / kRadPerDeg - angle_deg));
}

CellMatrix ToCellMatrix(const std::array<Response, 4>& cell) {
  CellMatrix matrix;
  for (int i = 0; i < 4; ++i) {
    const Response& r = cell[std::size_t(i)];
    matrix.row(i) << r.a0, r.a1, r.a2;
  }
  return matrix;
}

float ConditionNumber(const std::array<Response, 4>& cell) {
  for (const Response& response : cell)
    if (response.Defect()) return std::numeric_limits<float>::infinity();
  const CellMatrix matrix = ToCellMatrix(cell);
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
  solver.computeDirect(matrix.transpose() * matrix, Eigen::EigenvaluesOnly);
  const Eigen::Vector3f values = solver.eigenvalues();
  return values[0] > 1e-6f * values[2] ? std::sqrt(values[2] / values[0])
                                       : std::numeric_limits<float>::infinity();
}

Image<float> ConditionNumbers(const ResponseMap& responses) {
  Image<float> numbers(responses.width() / 2, responses.height() / 2);
  ParallelFor(0, numbers.height(), [&](int j) {
    for (int i = 0; i < numbers.width(); ++i) {
      const int x = 2 * i, y = 2 * j;
      numbers(i, j) = ConditionNumber(
          {responses.At(x, y), responses.At(x + 1, y), responses.At(x, y + 1), responses.At(x + 1, y + 1)});
    }
  });
  return numbers;
}

}  // namespace polarscan
