// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <string>
#include <vector>

#include "core/random.h"
#include "demosaic/calibration/polarizer/polarizer.h"
#include "imperfect_sensor.h"

namespace polarscan::test {

// What goes wrong in one frame of a turned polarizer.
enum class Mishap {
  kNone,
  kBumped,      // the polarizer moves by 12 degrees while the frame is exposed
  kDimmed,      // the lamp gives 15 % less
  kReflection,  // a spot of unpolarized light, 15 % of full scale
  kMislabelled  // the mount stands 2.5 degrees from where it is said to
};

// One calibration of a simulated camera (10500 electrons of full scale, 2.5 of read noise, 12 bits, pixels
// as in ImperfectSensor), frames over half a turn, by a mount that is good to mount_deg and a lamp that
// flickers.
struct Trial {
  int frames = 18;
  bool known = true;  // the mount's angles are given
  Mishap mishap = Mishap::kNone;
  double mount_deg = 0.1, flicker = 0.003;  // standard deviations
  int width = 128, height = 96;
  int BadFrame(std::uint64_t seed) const { return int(Random(seed, 5).Uniform() * frames) % frames; }
};

// Root mean square errors over the pixels; the angles' common part, which is the zero's, left out.
struct TrialErrors {
  double angle_deg = 0, diattenuation = 0;
};

inline ImperfectSensor TrialSensor(const Trial& trial, std::uint64_t seed) {
  ImperfectSensor sensor(trial.width, trial.height, seed);
  sensor.noise = 2.5 / 10500, sensor.electrons = 10500;
  return sensor;
}

// The light of frame k as it falls on the sensor.
inline Scene TrialScene(const Trial& trial, std::uint64_t seed, int k) {
  Random random(seed, 9, std::uint64_t(k));
  const bool bad = k == trial.BadFrame(seed);
  const auto is = [&](Mishap mishap) { return bad && trial.mishap == mishap; };
  const double angle_deg =
      k * 180.0 / trial.frames + trial.mount_deg * random.Normal() + (is(Mishap::kMislabelled) ? 2.5 : 0);
  const double brightness = 0.8 * (1 + trial.flicker * random.Normal()) * (is(Mishap::kDimmed) ? 0.85 : 1);
  const double moved_deg = is(Mishap::kBumped) ? 12 : 0;
  const Scene before = BehindPolarizer(angle_deg, 0.6 * brightness),
              after = BehindPolarizer(angle_deg + moved_deg, 0.4 * brightness);
  const double spot = is(Mishap::kReflection) ? 0.3 : 0, x0 = 0.3 * trial.width, y0 = 0.6 * trial.height;
  return [=](int x, int y, char colour) {
    const Stokes a = before(x, y, colour), b = after(x, y, colour);
    const double r2 = (std::pow(x - x0, 2) + std::pow(y - y0, 2)) / std::pow(0.15 * trial.width, 2);
    return Stokes{a.s0 + b.s0 + spot * std::exp(-r2 / 2), a.s1 + b.s1, a.s2 + b.s2};
  };
}

inline PolarizerCalibration Calibrated(const Trial& trial, const ImperfectSensor& sensor, std::uint64_t seed,
                                       Progress& progress) {
  CalibrationFrames frames;
  PolarizerKnowledge known;
  std::vector<double> given;
  for (int k = 0; k < trial.frames; ++k) {
    frames.names.push_back("frame-" + std::to_string(k));
    given.push_back(k * 180.0 / trial.frames);
  }
  if (trial.known) known.angles_deg = given;
  frames.counts = [&trial, &sensor, seed](int k) {
    return sensor.Take(TrialScene(trial, seed, k), 1000 * seed + std::uint64_t(k));
  };
  return CalibratePolarizer(frames, sensor.sensor, {}, known, false, progress);
}

inline TrialErrors ErrorsOf(const ResponseMap& found, const ImperfectSensor& sensor) {
  double sum = 0, squares = 0, diattenuations = 0, count = 0;
  for (int y = 0; y < found.height(); ++y)
    for (int x = 0; x < found.width(); ++x) {
      const Response a = found.At(x, y), b = sensor.truth.At(x, y);
      if (a.Defect()) continue;
      const int layout = sensor.sensor.layout.AngleAt(x, y);
      const double angle = double(AngleErrorDeg(a, layout)) - double(AngleErrorDeg(b, layout));
      sum += angle, squares += angle * angle, ++count;
      diattenuations += std::pow(double(a.Diattenuation()) - double(b.Diattenuation()), 2);
    }
  return {std::sqrt(squares / count - std::pow(sum / count, 2)), std::sqrt(diattenuations / count)};
}

}  // namespace polarscan::test
