// SPDX-License-Identifier: Apache-2.0
// stereo_speed [ROUNDS]: nanoseconds of stereo's kernels on one core, vectors against the scalar reference in
// the same run: the matching cost by its number of samples (taps), the sums over angles of polarization by
// their number, and the window sums of the matching on surfaces against the bandwidth of a copy in the same
// cache. The best of ROUNDS (20) counts: other programs may use the machine.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <vector>

#include "bench/timing.h"
#include "core/random.h"
#include "stereo/costs/ncc.h"
#include "stereo/costs/normal_from_aop.h"
#include "stereo/rounds/band_rows.h"

namespace polarscan::bench {
namespace {

constexpr int kWidth = 800, kHeight = 600;

Image<float> Scene() {
  Image<float> image(kWidth, kHeight);
  Random random(1);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      image(x, y) =
          float(0.5 + 0.2 * std::sin(0.35 * x) + 0.2 * std::cos(0.27 * y + 0.1 * x) + 0.02 * random.Normal());
  return image;
}

// Warps near the identity, pixel by pixel along rows, as a search asks for them.
std::vector<Warp> Warps(int count) {
  Random random(2);
  const auto near = [&](double value, double spread) {
    return float(value + random.Uniform(-spread, spread));
  };
  std::vector<Warp> warps;
  for (int i = 0; i < count; ++i) {
    const float u = near(100 + i % 500, 2), v = near(100 + i / 500, 2);
    warps.push_back(
        {u, near(1, 0.2), near(0, 0.2), v, near(0, 0.2), near(1, 0.2), 1, near(0, 1e-4), near(0, 1e-4)});
  }
  return warps;
}

using Cost = float (*)(const Window&, const Patch&, const Warp&, const PackedImage&, const Contrast&);

double NanosecondsPerTap(Cost cost, const Window& window, const Patch& patch, const PackedImage& source,
                         const std::vector<Warp>& warps, int rounds) {
  float sum = 0;
  const double seconds = BestSeconds(rounds, [&] {
    for (const Warp& warp : warps) sum += cost(window, patch, warp, source, {1e-5f});
  });
  if (!std::isfinite(sum)) std::puts("no sum");  // so that the work is needed
  return 1e9 * seconds / double(warps.size()) / window.taps;
}

void MeasureMatching(int rounds) {
  const Image<float> scene = Scene();
  const PackedImage source = Pack(scene);
  const std::vector<Warp> warps = Warps(20000);
  fmt::print("matching cost (NCC)      vectors  scalar  ns a tap   ratio\n");
  struct Kind {
    int radius, step;
    bool corners;
  };
  for (const Kind kind : {Kind{5, 2, false}, Kind{5, 2, true}, Kind{4, 1, false}, Kind{5, 1, true}}) {
    const Window window = MakeWindow(kind.radius, kind.step, kind.corners);
    Patch patch;
    PatchReader(window, 0.2).Read(scene, {}, kWidth / 2, kHeight / 2, patch);
    const double simd = NanosecondsPerTap(NccCostSimd, window, patch, source, warps, rounds);
    const double scalar = NanosecondsPerTap(NccCostScalar, window, patch, source, warps, rounds);
    fmt::print("  {:3} taps               {:7.2f} {:7.2f}           {:6.1f}\n", window.taps, simd, scalar,
               scalar / simd);
  }
}

void MeasureNormals(int rounds) {
  fmt::print("angles of polarization   vectors  scalar  ns a view  ratio\n");
  Random random(3);
  for (const int views : {8, 16, 24}) {
    AopTable table;
    const auto vector = [&] {
      return Eigen::Vector3f(float(random.Normal()), float(random.Normal()), float(random.Normal()))
          .normalized();
    };
    for (int i = 0; i < views; ++i) table.Add({vector(), vector(), 1.0f});
    table.Pad();
    constexpr int kTimes = 20000;
    const auto measure = [&](auto&& system) {
      Eigen::Vector3f normal = vector();
      const double seconds = BestSeconds(rounds, [&] {
        for (int i = 0; i < kTimes; ++i)
          normal = (normal + 0.1f * system(table, normal, 0.02f).col(0)).normalized();
      });
      return 1e9 * seconds / kTimes / views;
    };
    const double simd = measure(AopSystemSimd), scalar = measure(AopSystemScalar);
    fmt::print("  {:3} views              {:7.2f} {:7.2f}           {:6.1f}\n", views, simd, scalar,
               scalar / simd);
  }
}

void MeasureWindows(int rounds) {
  constexpr int kRows = 38, kBandWidth = 800, kTimes = 50;
  BandPlane a(0, kRows, kBandWidth), b = a, scratch = a, out = a;
  Random random(4);
  for (int y = 0; y < kRows; ++y)
    for (int x = 0; x < kBandWidth; ++x) a.Row(y)[x] = b.Row(y)[x] = float(random.Normal());
  const std::vector<float> taps = {0.3f, 0.2f, 0.1f, 0.05f};
  const double pixels = double(kTimes) * (kRows - 6) * kBandWidth;
  const double sums = BestSeconds(rounds, [&] {
    for (int i = 0; i < kTimes; ++i) WindowSums(a, b, taps, 3, kRows - 3, scratch, out);
  });
  const double copy = BestSeconds(rounds, [&] {
    for (int i = 0; i < kTimes; ++i)
      for (int y = 3; y < kRows - 3; ++y) std::memcpy(out.Row(y), a.Row(y), kBandWidth * sizeof(float));
  });
  fmt::print("window sums (7x7)        {:.2f} ns a pixel, as long as {:.1f} copies of the plane\n",
             1e9 * sums / pixels, sums / copy);
}

}  // namespace
}  // namespace polarscan::bench

int main(int argc, char** argv) {
  const int rounds = argc > 1 ? std::max(1, std::atoi(argv[1])) : 20;
  polarscan::bench::MeasureMatching(rounds);
  polarscan::bench::MeasureNormals(rounds);
  polarscan::bench::MeasureWindows(rounds);
}
