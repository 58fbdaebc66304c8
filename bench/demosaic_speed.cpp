// SPDX-License-Identifier: Apache-2.0
// demosaic_speed [ROUNDS]: frames per second of every method on a mosaic of 2448x2048 px, with all of TBB's
// threads, against two limits measured in the same run: the memory's bandwidth (a copy, bytes read and
// written) and OpenCV in two steps (two Bayer conversions for the four angles, then Stokes, as polanalyser
// does). The best of ROUNDS (20) counts: other programs may use the machine.
#include <fmt/format.h>
#include <tbb/info.h>

#include <cstdio>
#include <cstring>
#include <functional>
#include <opencv2/imgproc.hpp>

#include "bench/timing.h"
#include "core/parallel.h"
#include "core/random.h"
#include "demosaic/fused.h"
#include "demosaic/method.h"
#include "demosaic/polar_view.h"

namespace polarscan::bench {
namespace {

constexpr int kWidth = 2448, kHeight = 2048;
constexpr double kPixels = double(kWidth) * kHeight;

// Bytes a second, read and written, of all threads copying.
double CopyBandwidth(int rounds) {
  const std::size_t size = std::size_t(96) << 20, pieces = 96;
  std::vector<char> from(size, 1), to(size, 2);
  const double seconds = BestSeconds(rounds, [&] {
    ParallelFor(0, int(pieces), [&](int i) {
      const std::size_t at = std::size_t(i) * (size / pieces);
      std::memcpy(to.data() + at, from.data() + at, size / pieces);
    });
  });
  return 2 * double(size) / seconds;
}

// A smooth scene with noise, 20 % polarized.
Image<std::uint16_t> MakeMosaic(int bits) {
  Image<std::uint16_t> mosaic(kWidth, kHeight);
  Random random(1);
  const double full = (1 << bits) - 1;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double light = 0.4 + 0.2 * std::sin(0.01 * x) * std::cos(0.013 * y) + 0.05 * ((x ^ y) & 1);
      mosaic(x, y) = std::uint16_t(full * std::clamp(light + 0.01 * random.Normal(), 0.0, 1.0));
    }
  return mosaic;
}

Sensor MakeSensor(int bits) {
  Sensor sensor;
  sensor.bits = bits, sensor.white_dn = (1 << bits) - 1;
  return sensor;
}

struct Limits {
  int rounds;
  double bandwidth;
};

void PrintLine(const std::string& what, double seconds, double bytes, const Limits& limits) {
  fmt::print("| {} | {:.1f} | {:.1f} | {:.0f} % |\n", what, 1000 * seconds, 1 / seconds,
             100 * bytes / limits.bandwidth / seconds);
}

double MeasureFused(const std::string& method, const std::string& format_name, bool angles,
                    const Limits& limits) {
  const PixelFormat format = ParsePixelFormat(format_name);
  const std::vector<std::uint8_t> bytes = Pack(format, MakeMosaic(format.bits));
  FusedDemosaic demosaic(method, MakeSensor(format.bits), format, kWidth, kHeight);
  PolarPlanes planes;
  const double seconds = BestSeconds(limits.rounds, [&] { demosaic(bytes, planes, angles); });
  const double moved = double(bytes.size()) + kPixels * 4 * (angles ? 5 : 3);
  PrintLine(fmt::format("{}, {} to S0, S1, S2{}", method, format_name, angles ? ", DoP, AoP" : ""), seconds,
            moved, limits);
  return seconds;
}

void MeasurePlanes(const DemosaicMethod& method, const std::string& layout, const Limits& limits) {
  const Layout parsed = ParseLayout(layout);
  const Image<std::uint16_t> mosaic = MakeMosaic(12);
  Image<float> light(kWidth, kHeight);
  for (std::size_t i = 0; i < light.size(); ++i) light.pixels()[i] = float(mosaic.pixels()[i]) / 4095;
  std::vector<AnglePlanes> planes;
  const double seconds =
      BestSeconds(std::max(2, limits.rounds / 5), [&] { planes = method.interpolate(light, parsed); });
  PrintLine(fmt::format("{}, float mosaic {} to planes", method.name, layout), seconds,
            kPixels * 4 * (1 + 4 * double(planes.size())), limits);
}

// Two Bayer conversions and Stokes in float32. 12 bits are unpacked first, to 16.
double MeasureOpenCv(int bits, const Limits& limits) {
  const Image<std::uint16_t> mosaic = MakeMosaic(bits);
  const PixelFormat format = ParsePixelFormat(bits == 8 ? "Mono8" : "Mono12p");
  const std::vector<std::uint8_t> bytes = Pack(format, mosaic);
  cv::Mat angles[2], planes[2][3], s0, s1, s2, dop, aop;
  const double seconds = BestSeconds(std::max(2, limits.rounds / 4), [&] {
    Image<std::uint16_t> samples;
    if (bits != 8) samples = Unpack(format, bytes, kWidth, kHeight);
    const cv::Mat raw = bits == 8 ? cv::Mat(kHeight, kWidth, CV_8UC1, const_cast<std::uint8_t*>(bytes.data()))
                                  : cv::Mat(kHeight, kWidth, CV_16UC1, samples.row(0));
    cv::cvtColor(raw, angles[0], cv::COLOR_BayerBG2BGR);
    cv::cvtColor(raw, angles[1], cv::COLOR_BayerGR2BGR);
    for (int i = 0; i < 2; ++i) cv::split(angles[i], planes[i]);
    cv::subtract(planes[0][0], planes[0][2], s1, cv::noArray(), CV_32F);
    cv::subtract(planes[1][0], planes[1][2], s2, cv::noArray(), CV_32F);
    cv::add(planes[0][0], planes[0][2], s0, cv::noArray(), CV_32F);
    cv::cartToPolar(s1, s2, dop, aop);
    cv::divide(dop, s0, dop);
    aop *= 0.5;
  });
  PrintLine(fmt::format("OpenCV in two steps, {} bits to S0, S1, S2, DoP, AoP", bits), seconds,
            double(bytes.size()) + kPixels * 4 * 5, limits);
  return seconds;
}

void Run(int rounds) {
  const Limits limits{rounds, CopyBandwidth(rounds)};
  fmt::print(
      "{} threads; copy {:.1f} GB/s\n\n| {}x{} px | ms | frames/s | of the bandwidth |\n|---|---|---|---|\n",
      tbb::info::default_concurrency(), limits.bandwidth / 1e9, kWidth, kHeight);
  double fused = 0;
  for (const char* format : {"Mono8", "Mono12p", "Mono12Packed", "Mono12"})
    for (const bool angles : {false, true}) {
      const double seconds = MeasureFused("bilinear", format, angles, limits);
      if (angles && std::strcmp(format, "Mono8") == 0) fused = seconds;
    }
  for (const char* method : {"difference", "linear"})
    for (const char* format : {"Mono8", "Mono12p"}) MeasureFused(method, format, true, limits);
  for (const DemosaicMethod& method : DemosaicMethods()) MeasurePlanes(method, "90 45 / 135 0", limits);
  for (const DemosaicMethod& method : DemosaicMethods()) MeasurePlanes(method, "90 45 / 135 0 rggb", limits);
  const double rival = MeasureOpenCv(8, limits);
  MeasureOpenCv(12, limits);
  fmt::print("\nbilinear, Mono8 with DoP and AoP: {:.1f} times as fast as OpenCV in two steps\n",
             rival / fused);
}

}  // namespace
}  // namespace polarscan::bench

int main(int argc, char** argv) {
  try {
    polarscan::bench::Run(argc > 1 ? std::max(1, std::atoi(argv[1])) : 20);
  } catch (const std::exception& error) {
    return std::fprintf(stderr, "demosaic_speed: %s\n", error.what()), 1;
  }
}
