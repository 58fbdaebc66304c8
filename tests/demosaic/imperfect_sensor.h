// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "demosaic/calibration/frames.h"
#include "demosaic/calibration/response.h"
#include "demosaic/sensor/lit_mosaic.h"
#include "mosaic.h"

namespace polarscan::test {

inline void ExpectError(const std::function<void()>& f, const std::string& words) {
  try {
    f();
    ADD_FAILURE() << "no error: " << words;
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
  }
}

// A sensor whose pixels have gains, angles and diattenuations of their own, known to the test alone.
struct ImperfectSensor {
  Sensor sensor;
  ResponseMap truth;
  double noise = 0;       // standard deviation of a sample, of full scale
  double electrons = 0;   // of full scale, for shot noise beside it; 0: none
  Image<float> black_dn;  // of each pixel; empty: the sensor's

  // 2 % errors of gain, 1 degree of angle, diattenuation 0.95 to 0.99; 12 bits.
  ImperfectSensor(int width, int height, std::uint64_t seed, const std::string& layout = "90 45 / 135 0") {
    sensor.layout = ParseLayout(layout);
    sensor.bits = 12, sensor.black_dn = 60, sensor.white_dn = 4095;
    truth = IdealResponses(width, height, sensor.layout);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        Random random(seed, std::uint64_t(x), std::uint64_t(y));
        const double gain = 1 + 0.02 * random.Normal(), turn_deg = random.Normal();
        const double diattenuation = 0.95 + 0.04 * random.Uniform();
        truth.Set(x, y,
                  MakeResponse(gain, diattenuation, (sensor.layout.AngleAt(x, y) + turn_deg) * kRadPerDeg));
      }
  }

  double Black(int x, int y) const { return black_dn.empty() ? sensor.black_dn : double(black_dn(x, y)); }

  // Counts of a scene; `shot` tells the noise of one frame from that of another.
  Image<float> Take(const Scene& scene, std::uint64_t shot = 0) const {
    Image<float> counts(truth.width(), truth.height());
    for (int y = 0; y < counts.height(); ++y)
      for (int x = 0; x < counts.width(); ++x) {
        const Stokes s = scene(x, y, sensor.layout.ColourAt(x, y));
        const Response r = truth.At(x, y);
        Random random(77, shot, std::uint64_t(x), std::uint64_t(y));
        const double mean = r.a0 * s.s0 + r.a1 * s.s1 + r.a2 * s.s2;
        const double variance = noise * noise + (electrons > 0 ? std::max(0.0, mean) / electrons : 0);
        const double light = mean + std::sqrt(variance) * random.Normal();
        counts(x, y) =
            float(std::clamp(std::round(Black(x, y) + light * sensor.RangeDn()), 0.0, sensor.white_dn));
      }
    return counts;
  }
};

// Even light behind a polarizer at this angle; the brightest sample is about 0.8.
inline Scene BehindPolarizer(double angle_deg, double brightness = 0.8) {
  const double turn = 2 * angle_deg * kRadPerDeg;
  return [=](int, int, char) {
    return Stokes{brightness, brightness * std::cos(turn), brightness * std::sin(turn)};
  };
}

inline CalibrationFrames TurnedPolarizer(const ImperfectSensor& sensor,
                                         const std::vector<double>& angles_deg) {
  CalibrationFrames frames;
  for (const double angle : angles_deg) frames.names.push_back(std::to_string(int(std::lround(angle))));
  frames.counts = [&sensor, angles_deg](int k) {
    return sensor.Take(BehindPolarizer(angles_deg[std::size_t(k)]), 1000 + std::uint64_t(k));
  };
  return frames;
}

inline std::vector<double> EvenAngles(int count, double over_deg = 180) {
  std::vector<double> angles;
  for (int k = 0; k < count; ++k) angles.push_back(k * over_deg / count);
  return angles;
}

// Root mean square error of the angle of polarization in degrees of light of this degree of polarization,
// over the whole picture and twelve angles, without noise in the light: what the sensor's errors leave.
inline double AopErrorDeg(const ImperfectSensor& taken_with, const MosaicCorrection& correction,
                          double dop = 0.5) {
  ImperfectSensor quiet = taken_with;
  quiet.noise = 0;
  double sum = 0, count = 0;
  for (int aop = 7; aop < 180; aop += 15) {
    const double turn = 2 * aop * kRadPerDeg;
    const Scene scene = [&](int, int, char) {
      return Stokes{0.8, 0.8 * dop * std::cos(turn), 0.8 * dop * std::sin(turn)};
    };
    const Image<float> light = ToLitMosaic(quiet.Take(scene), quiet.sensor, correction).light;
    for (int y = 0; y + 1 < light.height(); y += 2)
      for (int x = 0; x + 1 < light.width(); x += 2) {
        double s1 = 0, s2 = 0;
        for (int i = 0; i < 4; ++i) {
          const int u = x + (i & 1), v = y + (i >> 1);
          const double angle = 2 * quiet.sensor.layout.AngleAt(u, v) * kRadPerDeg;
          s1 += light(u, v) * std::cos(angle), s2 += light(u, v) * std::sin(angle);
        }
        const double error = (std::atan2(s2, s1) - turn) / 2;
        const double wrapped = std::remainder(error, std::numbers::pi);
        sum += wrapped * wrapped, ++count;
      }
  }
  return std::sqrt(sum / count) / kRadPerDeg;
}

}  // namespace polarscan::test
