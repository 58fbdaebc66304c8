// SPDX-License-Identifier: Apache-2.0
// demosaic_quality TRUTH [NOISE]: every demosaicing method on every plane of the ground truth in TRUTH
// (bench/ground_truth.h), as the tables of docs/notes/demosaic-scenes.md. Fitted kernels are fitted anew for each scene,
// without that scene. NOISE: standard deviation of what is added to each sample, of full scale.
// opencv-bilinear, in colour, is a rival: OpenCV's bilinear Bayer step and bilinear polarization.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "bench/kernel_fit.h"
#include "core/error.h"
#include "core/random.h"
#include "demosaic/bayer.h"
#include "demosaic/methods/bilinear.h"
#include "demosaic/methods/sharp.h"
#include "demosaic/stokes.h"

namespace polarscan::bench {
namespace {

constexpr int kBorder = 15;  // px that do not count
constexpr float kPolarized = 0.1f;

// PSNR in dB for a peak of 1: S0 / 2; S1 and S2, the mean of the two; DoP. Root mean square error of AoP in
// degrees: everywhere; where DoP > 0.1.
using Scores = std::array<double, 5>;

Scores& operator+=(Scores& sum, const Scores& scores) {
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += scores[i];
  return sum;
}
Scores operator/(Scores scores, double count) {
  for (double& score : scores) score /= count;
  return scores;
}

class MeanSquare {
 public:
  void Add(double error) { sum_ += error * error, ++count_; }
  double Mean() const { return sum_ / std::max(count_, 1.0); }
  double Db() const { return -10 * std::log10(Mean()); }

 private:
  double sum_ = 0, count_ = 0;
};

float AngleBetween(float a, float b) {
  const float turn = std::abs(a - b);
  return std::min(turn, std::numbers::pi_v<float> - turn) * 180 / std::numbers::pi_v<float>;
}

Scores Score(const AnglePlanes& planes, const AnglePlanes& truth) {
  const auto [s0, s1, s2] = ToStokes(planes);
  const auto [t0, t1, t2] = ToStokes(truth);
  MeanSquare intensity, first, second, degree, angle, polarized_angle;
  for (int y = kBorder; y < s0.height() - kBorder; ++y)
    for (int x = kBorder; x < s0.width() - kBorder; ++x) {
      intensity.Add((s0(x, y) - t0(x, y)) / 2);
      first.Add(s1(x, y) - t1(x, y)), second.Add(s2(x, y) - t2(x, y));
      const float true_dop = DegreeOfPolarization(t0(x, y), t1(x, y), t2(x, y));
      degree.Add(DegreeOfPolarization(s0(x, y), s1(x, y), s2(x, y)) - true_dop);
      const float away =
          AngleBetween(AngleOfPolarization(s1(x, y), s2(x, y)), AngleOfPolarization(t1(x, y), t2(x, y)));
      angle.Add(away);
      if (true_dop > kPolarized) polarized_angle.Add(away);
    }
  return {intensity.Db(), (first.Db() + second.Db()) / 2, degree.Db(), std::sqrt(angle.Mean()),
          std::sqrt(polarized_angle.Mean())};
}

using Method = std::function<std::vector<AnglePlanes>(const Image<float>&, const Layout&)>;
struct Rival {
  std::string name;
  Method method;
};

// OpenCV's bilinear Bayer step (16 bit) on the half-size picture of each angle. RGGB.
std::vector<AnglePlanes> OpenCvBilinear(const Image<float>& samples, const Layout& layout) {
  std::vector<Image<float>> colours(3, Image<float>(samples.width(), samples.height()));
  for (int site = 0; site < 4; ++site) {
    cv::Mat half(samples.height() / 2, samples.width() / 2, CV_16UC1), rgb;
    for (int y = 0; y < half.rows; ++y)
      for (int x = 0; x < half.cols; ++x)
        half.at<std::uint16_t>(y, x) =
            cv::saturate_cast<std::uint16_t>(65535 * samples(2 * x + (site & 1), 2 * y + (site >> 1)));
    cv::cvtColor(half, rgb, cv::COLOR_BayerBG2RGB);
    for (int y = 0; y < half.rows; ++y)
      for (int x = 0; x < half.cols; ++x)
        for (int c = 0; c < 3; ++c)
          colours[std::size_t(c)](2 * x + (site & 1), 2 * y + (site >> 1)) =
              float(rgb.at<cv::Vec3w>(y, x)[c]) / 65535;
  }
  std::vector<AnglePlanes> planes;
  for (const Image<float>& colour : colours) planes.push_back(FillAngles(colour, layout));
  return planes;
}

// All methods; those with fitted kernels use these.
std::vector<Rival> Rivals(const LinearKernels& kernels) {
  std::vector<Rival> rivals;
  for (const DemosaicMethod& method : DemosaicMethods()) {
    if (method.name == "preview") continue;  // another name of bilinear
    if (method.name == "linear") {
      rivals.push_back({method.name, [&kernels](const Image<float>& samples, const Layout& layout) {
                          return InterpolateByColour(samples, layout,
                                                     [&](const auto& mono, const auto& angles) {
                                                       return FillByKernels(mono, angles, kernels);
                                                     });
                        }});
    } else if (method.name == "sharp") {
      rivals.push_back({method.name, [&kernels](const Image<float>& samples, const Layout& layout) {
                          return InterpolateByColour(samples, layout,
                                                     [&](const auto& mono, const auto& angles) {
                                                       return FillSharp(mono, angles, kernels);
                                                     });
                        }});
    } else {
      rivals.push_back({method.name, method.interpolate});
    }
  }
  return rivals;
}

struct Line {
  std::string scene, method;
  Scores scores;
};

void Print(const char* title, const std::vector<Line>& lines) {
  fmt::print(
      "\n{}\n\n| scene | method | S0 dB | S1, S2 dB | DoP dB | AoP deg | AoP deg, DoP > 0.1 |\n"
      "|---|---|---|---|---|---|---|\n",
      title);
  for (const auto& [scene, method, s] : lines)
    fmt::print("| {} | {} | {:.2f} | {:.2f} | {:.2f} | {:.1f} | {:.1f} |\n", scene, method, s[0], s[1], s[2],
               s[3], s[4]);
}

// The mean over all planes of each method, and what it is above the first one.
void PrintMeans(const std::vector<Line>& lines, const std::vector<double>& planes) {
  std::vector<std::string> methods;
  for (const Line& line : lines)
    if (std::ranges::find(methods, line.method) == methods.end()) methods.push_back(line.method);
  fmt::print(
      "\nMean over all planes; in brackets above {}.\n\n| method | S0 dB | S1, S2 dB | DoP dB | AoP deg "
      "| AoP deg, DoP > 0.1 |\n|---|---|---|---|---|---|\n",
      methods[0]);
  Scores base{};
  for (const std::string& method : methods) {
    Scores sum{};
    double count = 0;
    for (std::size_t i = 0; i < lines.size(); ++i)
      if (lines[i].method == method) {
        Scores weighted = lines[i].scores;
        for (double& score : weighted) score *= planes[i];
        sum += weighted, count += planes[i];
      }
    const Scores mean = sum / count;
    if (method == methods[0]) base = mean;
    fmt::print("| {} | {:.2f} ({:+.2f}) | {:.2f} ({:+.2f}) | {:.2f} ({:+.2f}) | {:.1f} | {:.1f} |\n", method,
               mean[0], mean[0] - base[0], mean[1], mean[1] - base[1], mean[2], mean[2] - base[2], mean[3],
               mean[4]);
  }
}

Image<float> AddNoise(Image<float> mosaic, double sigma) {
  Random random(1);
  for (float& sample : mosaic.pixels()) sample += float(sigma * random.Normal());
  return mosaic;
}

std::vector<LinearKernels> FitWithoutEach(const std::vector<TruthScene>& scenes) {
  std::vector<KernelSums> sums(scenes.size());
  for (std::size_t i = 0; i < scenes.size(); ++i)
    for (const AnglePlanes& plane : scenes[i].colours) sums[i] += SumPlane(plane);
  std::vector<LinearKernels> kernels;
  for (std::size_t without = 0; without < scenes.size(); ++without) {
    KernelSums rest;
    for (std::size_t i = 0; i < scenes.size(); ++i)
      if (i != without || scenes.size() == 1) rest += sums[i];
    kernels.push_back(Solve(rest));
  }
  return kernels;
}

void MeasureMono(const std::vector<TruthScene>& scenes, const std::vector<LinearKernels>& kernels,
                 double noise) {
  const Layout layout = ParseLayout("90 45 / 135 0");
  std::vector<Line> lines;
  std::vector<double> planes;
  for (std::size_t i = 0; i < scenes.size(); ++i)
    for (const Rival& rival : Rivals(kernels[i])) {
      Scores sum{};
      for (const AnglePlanes& plane : scenes[i].colours)
        sum += Score(rival.method(AddNoise(SampleMono(plane, layout), noise), layout)[0], plane);
      planes.push_back(double(scenes[i].colours.size()));
      lines.push_back({scenes[i].name, rival.name, sum / planes.back()});
    }
  Print("Mono sensor, mean over the scene's planes:", lines);
  PrintMeans(lines, planes);
}

void MeasureColour(const std::vector<TruthScene>& scenes, const std::vector<LinearKernels>& kernels,
                   double noise) {
  const Layout layout = ParseLayout("90 45 / 135 0 rggb");
  std::vector<Line> lines;
  std::vector<double> planes;
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    if (scenes[i].colours.size() != 3) continue;
    std::vector<Rival> rivals = Rivals(kernels[i]);
    rivals.insert(rivals.begin(), {"opencv-bilinear", OpenCvBilinear});
    const Image<float> mosaic = AddNoise(SampleColour(scenes[i].colours, layout), noise);
    for (const Rival& rival : rivals) {
      const std::vector<AnglePlanes> result = rival.method(mosaic, layout);
      Scores sum{};
      for (std::size_t c = 0; c < 3; ++c) sum += Score(result[c], scenes[i].colours[c]);
      lines.push_back({scenes[i].name, rival.name, sum / 3});
      planes.push_back(3);
    }
  }
  Print("Colour sensor, mean over red, green, blue:", lines);
  PrintMeans(lines, planes);
}

void Run(const char* folder, double noise) {
  const std::vector<TruthScene> scenes = ReadTruth(folder);
  const std::vector<LinearKernels> kernels = FitWithoutEach(scenes);
  MeasureMono(scenes, kernels, noise);
  MeasureColour(scenes, kernels, noise);
}

}  // namespace
}  // namespace polarscan::bench

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) return std::fputs("usage: demosaic_quality TRUTH [NOISE]\n", stderr), 2;
  try {
    polarscan::bench::Run(argv[1], argc > 2 ? std::atof(argv[2]) : 0);
  } catch (const std::exception& error) {
    return std::fprintf(stderr, "demosaic_quality: %s\n", error.what()), 1;
  }
}
