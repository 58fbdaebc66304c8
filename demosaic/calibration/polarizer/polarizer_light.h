// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace polarscan {

// Readings of N pixels in K frames (light, black subtracted) and each pixel's angle by the layout. The pixels
// come in whole cells, so that every angle is there equally often.
struct PolarizerReadings {
  Eigen::MatrixXf light;        // N x K
  std::vector<int> angles_deg;  // N
};

// What is known about the polarizer that was turned in front of even light.
struct PolarizerKnowledge {
  // Of each frame; none: unknown. Anticlockwise as displayed, from +x.
  std::optional<std::vector<double>> angles_deg = {};
  // Their zero is the picture's +x. Else it is put where the sensor's polarizers are right in the mean.
  bool zero_is_known = false;
  double degree = 1;                // of polarization behind it
  std::vector<std::string> frames;  // names, for messages
};

// The light of every frame.
struct PolarizerLight {
  Eigen::Matrix3Xd stokes;         // S0, S1, S2 of each frame; S0 is 1 in the mean
  std::vector<double> angles_deg;  // [0, 180), from the sensor's or the known zero
  double zero_deg = 0;             // by which given angles were turned, (-90, 90]
  double condition = 0;            // of the frames' angles: sqrt(2) if spread evenly, large if alike
  double largest_error_deg = 0;    // between given and found angles; 0 where unknown
};

// Readings = responses (N x 3) * light (3 x K): the three strongest components of the readings give the light
// up to a 3x3 matrix (factorization, as Tomasi and Kanade did for structure from motion, 1992). Which one
// follows from what is known of the light:
//   given angles: S1 / S0 and S2 / S0 of each frame, linear in the matrix; brightness may change by frame;
//   unknown angles: S1^2 + S2^2 = degree^2 S0^2 for each frame, linear in six products of the matrix, leaves
//   a Lorentz transformation open; brightness as even as can be fixes two of its parameters; the last one is
//   the zero, and the sense is the layout's.
// Throws Error, in words: fewer than 5 frames (6 with unknown angles), angles too much alike, given angles
// that do not fit the frames, a layout that does not.
PolarizerLight FindPolarizerLight(const PolarizerReadings& readings, const PolarizerKnowledge& known);

}  // namespace polarscan
