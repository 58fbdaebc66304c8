// SPDX-License-Identifier: Apache-2.0
// demosaic_speed [ROUNDS]: frames per second of every method on a mosaic of 2448x2048 px, with all of TBB's
// threads, against two limits measured in the same run: the memory's bandwidth (a copy between any two
// rounds, bytes read and written) and OpenCV in two steps (two Bayer conversions for the four angles, then
// Stokes, as polanalyser does). The best of ROUNDS (20) counts: other programs may use the machine.
#include <fmt/format.h>
#include <tbb/info.h>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include <cstdio>
#include <cstring>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <random>

#include "bench/timing.h"
#include "core/parallel.h"
#include "core/random.h"
#include "demosaic/fused/fused.h"
#include "demosaic/method.h"
#include "demosaic/polar_view.h"

namespace polarscan::bench {
namespace {

constexpr int kWidth = 2448, kHeight = 2048;
constexpr double kPixels = double(kWidth) * kHeight;

// Writes past the caches where the machine can, which saves reading what is overwritten.
void StreamCopy(const char* from, char* to, std::size_t size) {
#ifdef __SSE2__
  const auto* in = reinterpret_cast<const __m128i*>(from);
  auto* out = reinterpret_cast<__m128i*>(to);
  for (std::size_t i = 0; i < size / 16; ++i) _mm_stream_si128(out + i, _mm_loadu_si128(in + i));
  _mm_sfence();
#else
  std::memcpy(to, from, size);
#endif
}

// All threads copying 96 MB, by memcpy or past the caches, whichever is faster. The bytes are random, as low
// bits of pictures are: some machines move lines of equal bytes at twice the speed.
class Copy {
 public:
  Copy() {
    std::mt19937_64 random;
    for (int i = 0; i < kPieces; ++i)
      for (std::size_t at = 0; at < kPiece; at += sizeof(std::uint64_t)) {
        const std::uint64_t bytes = random();
        std::memcpy(from_.row(i) + at, &bytes, sizeof bytes);
      }
  }

  // Bytes a second, read and written.
  double Bandwidth() {
    double seconds = 1e9;
    for (const bool stream : {false, true})
      seconds = std::min(seconds, BestSeconds(1, [&] {
                           ParallelFor(0, kPieces, [&](int i) {
                             const char* from = from_.row(i);
                             stream ? StreamCopy(from, to_.row(i), kPiece)
                                    : void(std::memcpy(to_.row(i), from, kPiece));
                           });
                         }));
    return 2.0 * kPiece * kPieces / seconds;
  }

 private:
  static constexpr int kPiece = 1 << 20, kPieces = 96;
  Image<char> from_{kPiece, kPieces}, to_{kPiece, kPieces, 1};
};

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
  Copy copy;
};

// Rounds of f and of copying alternate: what else the machine does hits both. The best of each counts.
template <class F>
double Measure(const std::string& what, double bytes, int rounds, Limits& limits, F&& f) {
  double seconds = 1e9, bandwidth = 0;
  for (int i = 0; i < rounds; ++i) {
    seconds = std::min(seconds, BestSeconds(1, f));
    bandwidth = std::max(bandwidth, limits.copy.Bandwidth());
  }
  fmt::print("| {} | {:.1f} | {:.1f} | {:.1f} | {:.0f} % |\n", what, 1000 * seconds, 1 / seconds,
             bandwidth / 1e9, 100 * bytes / bandwidth / seconds);
  std::fflush(stdout);
  return seconds;
}

double MeasureFused(const std::string& method, const std::string& format_name, bool angles, Limits& limits) {
  const PixelFormat format = ParsePixelFormat(format_name);
  const std::vector<std::uint8_t> bytes = Pack(format, MakeMosaic(format.bits));
  FusedDemosaic demosaic(method, MakeSensor(format.bits), format, kWidth, kHeight);
  PolarPlanes planes;
  return Measure(fmt::format("{}, {} to S0, S1, S2{}", method, format_name, angles ? ", DoP, AoP" : ""),
                 double(bytes.size()) + kPixels * 4 * (angles ? 5 : 3), limits.rounds, limits,
                 [&] { demosaic(bytes, planes, angles); });
}

void MeasurePlanes(const DemosaicMethod& method, const std::string& layout, Limits& limits) {
  const Layout parsed = ParseLayout(layout);
  const Image<std::uint16_t> mosaic = MakeMosaic(12);
  Image<float> light(kWidth, kHeight);
  for (std::size_t i = 0; i < light.size(); ++i) light.pixels()[i] = float(mosaic.pixels()[i]) / 4095;
  std::vector<AnglePlanes> planes;
  const double count = parsed.bayer.empty() ? 4 : 12;
  Measure(fmt::format("{}, float mosaic {} to planes", method.name, layout), kPixels * 4 * (1 + count),
          std::max(2, limits.rounds / 5), limits, [&] { planes = method.interpolate(light, parsed); });
}

// Two Bayer conversions and Stokes in float32. 12 bits are unpacked first, to 16.
double MeasureOpenCv(int bits, Limits& limits) {
  const Image<std::uint16_t> mosaic = MakeMosaic(bits);
  const PixelFormat format = ParsePixelFormat(bits == 8 ? "Mono8" : "Mono12p");
  const std::vector<std::uint8_t> bytes = Pack(format, mosaic);
  cv::Mat angles[2], planes[2][3], s0, s1, s2, dop, aop;
  const std::string what = fmt::format("OpenCV in two steps, {} bits to S0, S1, S2, DoP, AoP", bits);
  return Measure(what, double(bytes.size()) + kPixels * 4 * 5, std::max(2, limits.rounds / 4), limits, [&] {
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
}

void Run(int rounds) {
  Limits limits{rounds, Copy()};
  fmt::print("{} threads\n\n| {}x{} px | ms | frames/s | copying, GB/s | of that |\n|---|---|---|---|---|\n",
             tbb::info::default_concurrency(), kWidth, kHeight);
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
