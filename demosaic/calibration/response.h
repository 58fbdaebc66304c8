// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <numbers>

#include "core/image.h"
#include "demosaic/sensor/layout.h"

namespace polarscan {

inline constexpr double kRadPerDeg = std::numbers::pi / 180;

// The same direction of a polarizer in (-90, 90] degrees.
double WrapHalfTurn(double degrees);

// What a pixel behind its own, imperfect polarizer reads of light (S0, S1, S2), black subtracted:
//   a0 S0 + a1 S1 + a2 S2 = gain / 2 (S0 + diattenuation (S1 cos 2 angle + S2 sin 2 angle)).
// Ideal: gain 1, diattenuation 1, angle as the layout says. Diattenuation, because the extinction ratio is
// statistically unstable (Hagen, Opt. Eng. 58:082408, 2019). a0 = 0: the pixel is defect.
struct Response {
  float a0 = 0, a1 = 0, a2 = 0;

  float Gain() const { return 2 * a0; }
  float Diattenuation() const;
  float AngleRad() const;  // [0, pi)
  bool Defect() const { return a0 <= 0; }
};

Response MakeResponse(double gain, double diattenuation, double angle_rad);
Response IdealResponse(int angle_deg);

// One response a pixel.
struct ResponseMap {
  Image<float> a0, a1, a2;

  int width() const { return a0.width(); }
  int height() const { return a0.height(); }
  bool empty() const { return a0.empty(); }
  Response At(int x, int y) const { return {a0(x, y), a1(x, y), a2(x, y)}; }
  void Set(int x, int y, const Response& response) {
    a0(x, y) = response.a0, a1(x, y) = response.a1, a2(x, y) = response.a2;
  }
};

ResponseMap IdealResponses(int width, int height, const Layout& layout);

// How far a pixel's polarizer is turned from where the layout has it, in (-90, 90] degrees, anticlockwise.
float AngleErrorDeg(const Response& response, int angle_deg);

// The responses of a 2x2 cell, row by row: readings = CellMatrix * (S0, S1, S2).
using CellMatrix = Eigen::Matrix<float, 4, 3>;
using CellSamples = Eigen::Vector4f;
CellMatrix ToCellMatrix(const std::array<Response, 4>& cell);

// How much worse than S0 the worst of the Stokes components is determined by the cell (ratio of the extreme
// singular values): sqrt(2) for ideal polarizers, infinite where they are all alike or a pixel is defect.
float ConditionNumber(const std::array<Response, 4>& cell);

// The same for every cell of a sensor: at half the size.
Image<float> ConditionNumbers(const ResponseMap& responses);

}  // namespace polarscan
