// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <array>
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

// Standard deviations of what a pixel's response is found to be.
struct ResponseDeviation {
  double angle_deg = 0, diattenuation = 0;
};

// A frame that is not what all others are.
struct FrameDoubt {
  int frame = 0;
  std::string name;       // the frame's
  std::string words;      // "it is 12.0 % darker than the others"
  bool left_out = false;  // its readings are of no use; else only its light was found without trusting it
};

// The light of every frame, and what is known of the readings' noise.
struct PolarizerLight {
  Eigen::Matrix3Xd stokes;         // S0, S1, S2 of each frame; S0 is 1 in the mean
  std::vector<double> angles_deg;  // [0, 180), from the sensor's or the known zero
  double zero_deg = 0;             // by which given angles were turned, (-90, 90]
  double condition = 0;            // of the frames' angles: sqrt(2) if spread evenly, large if alike
  double largest_error_deg = 0;    // between given and found angles, of frames without doubt; 0 where unknown
  std::vector<FrameDoubt> doubts;
  // 4 x K: what a reading of pixels at 0, 45, 90 and 135 degrees counts in each frame, by its noise; 1 in
  // the mean. 0: the frame is left out.
  Eigen::Matrix4Xd weights;
  // Of pixels at 0, 45, 90 and 135 degrees: by the readings' noise, each pixel for itself; and by what is
  // not known of the light, all pixels alike.
  std::array<ResponseDeviation, 4> by_noise{}, by_light{};
};

// Readings = responses (N x 3) * light (3 x K): the three strongest components of the readings give the light
// up to a 3x3 matrix (factorization, as Tomasi and Kanade did for structure from motion, 1992). Which one
// follows from what is known of the light:
//   given angles: S1 / S0 and S2 / S0 of each frame, linear in the matrix; brightness may change by frame;
//   unknown angles: S1^2 + S2^2 = degree^2 S0^2 for each frame, linear in six products of the matrix, leaves
//   a Lorentz transformation open; brightness as even as can be fixes two of its parameters; the last one is
//   the zero, and the sense is the layout's.
// That is where a maximum-likelihood refinement starts (light_refinement.h). Frames that do not fit the
// others are doubted: at most one in 10, from 9 frames on. One whose light is uneven in another way than
// the others' (a reflection, a shadow: its readings leave the three components by more than twice the usual
// deviation) is left out. Throws Error, in words: fewer than 5 frames (6 with unknown angles), angles too
// much alike, given angles that do not fit the frames, a layout that does not.
PolarizerLight FindPolarizerLight(const PolarizerReadings& readings, const PolarizerKnowledge& known);

}  // namespace polarscan
