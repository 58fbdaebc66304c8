// SPDX-License-Identifier: Apache-2.0
#include "bench/kernel_fit.h"

#include <Eigen/LU>
#include <functional>

#include "demosaic/methods/bilinear.h"
#include "demosaic/methods/guide.h"
#include "demosaic/methods/residual.h"
#include "demosaic/methods/sharp.h"

namespace polarscan::bench {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Kernel = LinearKernels::Kernel;

constexpr int kTaps = 16, kMargin = 4, kRowStep = 2;
constexpr int kS0Taps = 3;  // of sharpen_s0: (1, 0), (0, 1), (1, 1)
constexpr double kRidge = 1e-9, kDark = 0.05;

// Sum of the pixels at (+-u, +-v), each once.
float Orbit(const Image<float>& image, int x, int y, int u, int v) {
  float sum = image(x + u, y + v);
  if (u) sum += image(x - u, y + v);
  if (v) sum += image(x + u, y - v);
  if (u && v) sum += image(x - u, y - v);
  return sum;
}

double Members(int tap) { return (tap % 4 ? 2 : 1) * (tap / 4 ? 2 : 1); }

// Gain of each tap for the carrier (-1)^y (row), (-1)^x (column), both, or neither (constant light).
VectorXd Response(bool row, bool column, int size) {
  VectorXd response = VectorXd::Zero(size);
  for (int i = 0; i < kTaps; ++i) {
    const bool minus = (row && (i / 4 & 1)) != (column && (i % 4 & 1));
    response[i] = minus ? -Members(i) : Members(i);
  }
  return response;
}

// features(x, y, out) fills `size` numbers, then the target; weight(x, y).
Normal Sum(int width, int height, int size, const std::function<void(int, int, float*)>& features,
           const std::function<float(int, int)>& weight) {
  MatrixXd sums = MatrixXd::Zero(size + 1, size + 1);
  Eigen::MatrixXf row(size + 1, width - 2 * kMargin), weighted = row;
  for (int y = kMargin; y < height - kMargin; y += kRowStep) {
    for (int x = kMargin; x < width - kMargin; ++x) {
      features(x, y, row.col(x - kMargin).data());
      weighted.col(x - kMargin) = weight(x, y) * row.col(x - kMargin);
    }
    sums += (weighted * row.transpose()).cast<double>();
  }
  sums /= double(width) * height;
  return {sums.topLeftCorner(size, size), sums.topRightCorner(size, 1)};
}

struct Mosaic {
  Image<float> twice;  // 2 M
  std::array<Carrier, 2> carriers;
};

Mosaic TakeMosaic(const AnglePlanes& truth, const Layout& layout) {
  Mosaic mosaic{SampleMono(truth, layout), Carriers(layout)};
  for (float& value : mosaic.twice.pixels()) value *= 2;
  return mosaic;
}

using Stokes = std::array<Image<float>, 3>;

Normal SumS0(const Mosaic& mosaic, const Stokes& truth, float weight) {
  const Image<float>& image = mosaic.twice;
  return Sum(
      image.width(), image.height(), kTaps,
      [&](int x, int y, float* out) {
        for (int i = 0; i < kTaps; ++i) out[i] = Orbit(image, x, y, i % 4, i / 4);
        out[kTaps] = truth[0](x, y);
      },
      [&](int, int) { return weight; });
}

Normal SumCarrier(const Mosaic& mosaic, const Carrier& carrier, const Stokes& truth) {
  const Image<float>& image = mosaic.twice;
  return Sum(
      image.width(), image.height(), kTaps,
      [&](int x, int y, float* out) {
        for (int i = 0; i < kTaps; ++i) out[i] = Orbit(image, x, y, i % 4, i / 4);
        out[kTaps] = carrier.SignAt(x, y) * (carrier.q1 * truth[1](x, y) + carrier.q2 * truth[2](x, y));
      },
      [&](int x, int y) { return float(1 / (truth[0](x, y) + kDark)); });
}

// Features: what 2 M and the neighbours' S0 differ from EARI's S0; target: what the truth does.
Normal SumSharpen(const Image<float>& samples, const Layout& layout, const Stokes& truth, float weight) {
  const Image<float> s0 = MeanS0(FillAnglesByResidual(samples, layout, EdgeAwareGuide(samples)));
  constexpr int kPlaces[kS0Taps][2] = {{1, 0}, {0, 1}, {1, 1}};
  return Sum(
      samples.width(), samples.height(), kTaps + kS0Taps,
      [&](int x, int y, float* out) {
        const float own = s0(x, y);
        for (int i = 0; i < kTaps; ++i)
          out[i] = 2 * Orbit(samples, x, y, i % 4, i / 4) - float(Members(i)) * own;
        for (const auto& [u, v] : kPlaces) {
          const int i = int(&u - &kPlaces[0][0]) / 2;
          out[kTaps + i] = Orbit(s0, x, y, u, v) - float(u && v ? 4 : 2) * own;
        }
        out[kTaps + kS0Taps] = truth[0](x, y) - own;
      },
      [&](int, int) { return weight; });
}

// The same with x and y exchanged.
Normal Transpose(const Normal& normal) {
  const Eigen::Index size = normal.xy.size();
  Normal transposed{MatrixXd(size, size), VectorXd(size)};
  const auto swapped = [](Eigen::Index i) {
    if (i < kTaps) return i % 4 * 4 + i / 4;
    return i == kTaps ? kTaps + 1 : i == kTaps + 1 ? Eigen::Index(kTaps) : i;
  };
  for (Eigen::Index i = 0; i < size; ++i) {
    transposed.xy[i] = normal.xy[swapped(i)];
    for (Eigen::Index j = 0; j < size; ++j) transposed.xx(i, j) = normal.xx(swapped(i), swapped(j));
  }
  return transposed;
}

Normal operator+(Normal a, const Normal& b) { return a += b; }

struct Condition {
  VectorXd response;
  double gain;
};

// Least squares under linear conditions, by Lagrange multipliers.
VectorXd SolveUnder(const Normal& normal, const std::vector<Condition>& conditions) {
  const Eigen::Index n = normal.xy.size(), m = Eigen::Index(conditions.size());
  MatrixXd system = MatrixXd::Zero(n + m, n + m);
  VectorXd right(n + m);
  const double scale = normal.xx.trace() / double(n);
  system.topLeftCorner(n, n) = normal.xx / scale + kRidge * MatrixXd::Identity(n, n);
  right.head(n) = normal.xy / scale;
  for (Eigen::Index i = 0; i < m; ++i) {
    system.block(n + i, 0, 1, n) = conditions[std::size_t(i)].response.transpose();
    system.block(0, n + i, n, 1) = conditions[std::size_t(i)].response;
    right[n + i] = conditions[std::size_t(i)].gain;
  }
  return system.fullPivLu().solve(right).head(n);
}

Kernel ToKernel(const VectorXd& taps) {
  Kernel kernel;
  for (int i = 0; i < kTaps; ++i) kernel[std::size_t(i)] = float(taps[i]);
  return kernel;
}

// wanted: 0 constant light, 1 the first carrier, 2 the second.
Kernel SolveKernel(const Normal& normal, const std::array<std::pair<bool, bool>, 2>& carriers, int wanted) {
  std::vector<Condition> conditions = {{Response(false, false, kTaps), wanted == 0 ? 1. : 0.}};
  for (int i = 0; i < 2; ++i)
    conditions.push_back({Response(carriers[std::size_t(i)].first, carriers[std::size_t(i)].second, kTaps),
                          wanted == i + 1 ? 1. : 0.});
  return ToKernel(SolveUnder(normal, conditions));
}

float InverseSquaredError(const Image<float>& samples, const Layout& layout, const Stokes& truth) {
  const Image<float> s0 = MeanS0(FillAngles(samples, layout));
  double sum = 0;
  for (std::size_t i = 0; i < s0.size(); ++i) {
    const double error = s0.pixels()[i] - truth[0].pixels()[i];
    sum += error * error;
  }
  return float(1e-4 * double(s0.size()) / sum);
}

}  // namespace

Normal& Normal::operator+=(const Normal& other) {
  if (xx.size() == 0) return *this = other;
  xx += other.xx, xy += other.xy;
  return *this;
}

KernelSums& KernelSums::operator+=(const KernelSums& other) {
  across_s0 += other.across_s0, across_carrier += other.across_carrier;
  in_row_s0 += other.in_row_s0, in_row_first += other.in_row_first, in_row_second += other.in_row_second;
  sharpen += other.sharpen;
  return *this;
}

KernelSums SumPlane(const AnglePlanes& truth) {
  const Layout across_layout = ParseLayout("90 45 / 135 0"), in_row_layout = ParseLayout("0 90 / 45 135");
  const Mosaic across = TakeMosaic(truth, across_layout), in_row = TakeMosaic(truth, in_row_layout);
  const Stokes stokes = ToStokes(truth);
  const Image<float> samples = SampleMono(truth, across_layout);
  const float weight = InverseSquaredError(samples, across_layout, stokes);
  KernelSums sums;
  sums.across_s0 = SumS0(across, stokes, weight);
  sums.across_s0 += Transpose(sums.across_s0);
  sums.across_carrier = SumCarrier(across, across.carriers[0], stokes) +
                        Transpose(SumCarrier(across, across.carriers[1], stokes));
  sums.in_row_s0 = SumS0(in_row, stokes, weight);
  sums.in_row_first = SumCarrier(in_row, in_row.carriers[0], stokes);
  sums.in_row_second = SumCarrier(in_row, in_row.carriers[1], stokes);
  sums.sharpen = SumSharpen(samples, across_layout, stokes, weight);
  sums.sharpen += Transpose(sums.sharpen);
  return sums;
}

LinearKernels Solve(const KernelSums& sums) {
  constexpr std::array<std::pair<bool, bool>, 2> kAcross = {std::pair{true, false}, {false, true}},
                                                 kInRow = {std::pair{false, true}, {true, true}};
  LinearKernels kernels;
  kernels.across = {
      SolveKernel(sums.across_s0, kAcross, 0), SolveKernel(sums.across_carrier, kAcross, 1), {}};
  for (std::size_t i = 0; i < kTaps; ++i) kernels.across.second[i] = kernels.across.first[i % 4 * 4 + i / 4];
  kernels.in_row = {SolveKernel(sums.in_row_s0, kInRow, 0), SolveKernel(sums.in_row_first, kInRow, 1),
                    SolveKernel(sums.in_row_second, kInRow, 2)};
  std::vector<Condition> conditions;
  for (const auto& [row, column] : {std::pair{true, false}, {false, true}, {true, true}})
    conditions.push_back({Response(row, column, kTaps + kS0Taps), 0});
  const VectorXd taps = SolveUnder(sums.sharpen, conditions);
  kernels.sharpen_mosaic = ToKernel(taps);
  kernels.sharpen_s0[1] = float(taps[kTaps]), kernels.sharpen_s0[4] = float(taps[kTaps + 1]),
  kernels.sharpen_s0[5] = float(taps[kTaps + 2]);
  return kernels;
}

}  // namespace polarscan::bench
