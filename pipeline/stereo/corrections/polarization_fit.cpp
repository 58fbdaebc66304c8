// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/corrections/polarization_fit.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "core/statistics.h"
#include "pipeline/coarse_shape.h"
#include "pipeline/stereo/stage_inputs.h"

namespace polarscan {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kSamples = 20000;
constexpr double kLeastSlope =
    0.26;  // sine of the angle between normal and ray: an azimuth of flatter ones is noise
constexpr std::size_t kEnough = 500;  // samples
// What is beyond doubt: so many deviations, and as much as matters.
constexpr double kSigmas = 5, kLeastTurnDeg = 1.5, kLeastBias = 0.004;
// What makes a fit doubtful. Of sound sets the cost of mirrored angles is 1.6 times the other's.
constexpr double kDoubtfulTurnDeg = 1.2, kDoubtfulBias = 0.004, kDoubtfulMirrored = 1.3;

// Degrees of polarization along the picture's axes, and twice the azimuth of the surface there.
struct Sample {
  double p = 0, q = 0, cosine = 1, sine = 0;
};

struct Model {
  double turn = 0;  // radians, of twice the angle
  double bias_p = 0, bias_q = 0;
};

// Mean of S1 / S0 and S2 / S0 over the pixels that one of the map covers; none if it is dark or invalid.
std::optional<Eigen::Vector2d> MeanDegrees(const StokesImage& light, int x, int y, int size) {
  double s0 = 0, s1 = 0, s2 = 0;
  for (int v = y * size; v < (y + 1) * size; ++v)
    for (int u = x * size; u < (x + 1) * size; ++u) {
      if (!light.s0.Contains(u, v) || !std::isfinite(light.noise(u, v))) return {};
      s0 += double(light.s0(u, v)), s1 += double(light.s1(u, v)), s2 += double(light.s2(u, v));
    }
  if (!(s0 > 0)) return {};
  return Eigen::Vector2d(s1 / s0, s2 / s0);
}

std::vector<Sample> SamplesOf(const Workspace& workspace, int view, const MapKind& kind, int halvings,
                              int count) {
  const Image<float> depth = ReadMaps(workspace, view, kind).depth;
  const StokesImage light = ReadViewLight(workspace, view);
  const Pinhole camera = workspace.views[std::size_t(view)].camera.Resized(depth.width(), depth.height());
  std::vector<Sample> samples;
  for (const auto& [x, y, n] : CoarseNormals(depth, camera, count, Random(7, std::uint64_t(view)))) {
    const auto degrees = MeanDegrees(light, x, y, 1 << halvings);
    const Eigen::Vector3d ray = camera.Ray(x + 0.5, y + 0.5);
    if (!degrees || n.cross(ray.normalized()).norm() < kLeastSlope) continue;
    const double azimuth = std::atan2(-(n.y() - n.z() * ray.y()), n.x() - n.z() * ray.x());
    samples.push_back({degrees->x(), degrees->y(), std::cos(2 * azimuth), std::sin(2 * azimuth)});
  }
  return samples;
}

// (S1, S2), corrected, across the direction of the surface: 0 if the model is right.
double Across(const Sample& s, const Model& model) {
  const double c = std::cos(model.turn), d = std::sin(model.turn), p = s.p - model.bias_p,
               q = s.q - model.bias_q;
  return (c * p - d * q) * s.sine - (d * p + c * q) * s.cosine;
}

// Huber's cost, of residuals in units of `scale`, and its weight.
double Cost(double residual, double scale) {
  const double r = std::abs(residual) / scale;
  return r < 1 ? r * r / 2 : r - 0.5;
}
double Weight(double residual, double scale) {
  return std::min(1.0, scale / std::max(1e-12, std::abs(residual)));
}

double MeanCost(const std::vector<Sample>& samples, const Model& model, double scale) {
  double sum = 0;
  for (const Sample& s : samples) sum += Cost(Across(s, model), scale);
  return sum / double(samples.size());
}

enum class Free { kTurn, kBias, kBoth };

// Gauss-Newton with Huber's weights.
Model Fitted(const std::vector<Sample>& samples, Model model, double scale, Free free) {
  for (int i = 0; i < 20; ++i) {
    Eigen::Matrix3d squares = 1e-9 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    const double c = std::cos(model.turn), d = std::sin(model.turn);
    for (const Sample& s : samples) {
      const double r = Across(s, model), w = Weight(r, scale);
      const double p = s.p - model.bias_p, q = s.q - model.bias_q;
      Eigen::Vector3d slope((-d * p - c * q) * s.sine - (c * p - d * q) * s.cosine,
                            -c * s.sine + d * s.cosine, d * s.sine + c * s.cosine);
      if (free == Free::kTurn) slope.tail<2>().setZero();
      if (free == Free::kBias) slope[0] = 0;
      squares += w * slope * slope.transpose();
      right -= w * r * slope;
    }
    const Eigen::Vector3d step = squares.ldlt().solve(right);
    model.turn += step[0], model.bias_p += step[1], model.bias_q += step[2];
    if (step.norm() < 1e-8) break;
  }
  model.turn = std::remainder(model.turn, kPi);  // by 90 degrees of angle there is no telling
  return model;
}

// The best of many starts.
Model BestFit(const std::vector<Sample>& samples, double scale, Free free) {
  Model best;
  double least = MeanCost(samples, best, scale);
  for (int start = -8; start < 8; ++start) {
    const Model model = Fitted(samples, {free == Free::kBias ? 0 : start * kPi / 16, 0, 0}, scale, free);
    const double cost = MeanCost(samples, model, scale);
    if (cost < least * (1 - 1e-9)) least = cost, best = model;
  }
  return best;
}

// What most samples lie within, with no model.
double ScaleOf(const std::vector<Sample>& samples) {
  std::vector<double> sizes;
  for (const Sample& s : samples) sizes.push_back(std::hypot(s.p, s.q));
  return std::max(1e-6, Median(std::move(sizes)) / 2);
}

std::vector<Sample> Mirrored(std::vector<Sample> samples) {
  for (Sample& s : samples) s.q = -s.q;
  return samples;
}

std::vector<Sample> Together(const std::vector<std::vector<Sample>>& of_views) {
  std::vector<Sample> all;
  for (const auto& samples : of_views) all.insert(all.end(), samples.begin(), samples.end());
  return all;
}

// Standard deviation of the mean over views, from the median of what they differ by.
double SigmaOfMean(const std::vector<double>& values, double middle) {
  std::vector<double> away;
  for (double value : values) away.push_back(std::abs(value - middle));
  return 1.48 * Median(std::move(away)) / std::sqrt(double(values.size()));
}

struct Spread {
  double turn = 0, bias = 0;
};

// Each view's own fit, from that of all on.
Spread SpreadOfViews(const std::vector<std::vector<Sample>>& of_views, const Model& model, double scale,
                     Free free) {
  std::vector<double> turns, p, q;
  for (const auto& samples : of_views) {
    if (samples.size() < 50) continue;
    const Model own = Fitted(samples, model, scale, free);
    turns.push_back(model.turn + std::remainder(own.turn - model.turn, kPi));
    p.push_back(own.bias_p), q.push_back(own.bias_q);
  }
  if (turns.size() < 3) return {1e9, 1e9};
  return {SigmaOfMean(turns, model.turn),
          std::hypot(SigmaOfMean(p, model.bias_p), SigmaOfMean(q, model.bias_q))};
}

// By how many deviations the second model costs less than the first, from view to view; each of its own samples.
double BetterBy(const std::vector<std::vector<Sample>>& first_views, const Model& first,
                const std::vector<std::vector<Sample>>& second_views, const Model& second, double scale) {
  std::vector<double> gains;
  for (std::size_t v = 0; v < first_views.size(); ++v)
    if (first_views[v].size() >= 50)
      gains.push_back(MeanCost(first_views[v], first, scale) - MeanCost(second_views[v], second, scale));
  if (gains.size() < 3) return 0;
  double mean = 0, squares = 0;
  const double n = double(gains.size());
  for (double gain : gains) mean += gain / n;
  for (double gain : gains) squares += (gain - mean) * (gain - mean);
  return mean / std::max(1e-12, std::sqrt(squares / (n - 1) / n));
}

std::vector<std::vector<Sample>> SamplesOfViews(const Workspace& workspace, const MapKind& kind, int halvings,
                                                Progress& progress) {
  const std::vector<int> views = SomeViews(workspace, kind);
  std::vector<std::vector<Sample>> of_views(views.size());
  progress.Begin("fit of the polarization", views.size());
  ParallelFor(0, int(views.size()), [&](int i) {
    progress.Check();
    of_views[std::size_t(i)] =
        SamplesOf(workspace, views[std::size_t(i)], kind, halvings, kSamples / int(views.size()));
  });
  return of_views;
}

}  // namespace

PolarizationFit FitPolarization(const Workspace& workspace, const MapKind& kind, int halvings,
                                Progress& progress) {
  PolarizationFit fit;
  std::vector<std::vector<Sample>> of_views = SamplesOfViews(workspace, kind, halvings, progress);
  std::vector<Sample> samples = Together(of_views);
  if (samples.size() < kEnough) return fit;
  const double scale = ScaleOf(samples);
  // Counted the other way? With a turn free both ways: a mirror's axis is anywhere.
  const std::vector<Sample> other = Mirrored(samples);
  const Model given_model = BestFit(samples, scale, Free::kTurn),
              mirrored_model = BestFit(other, scale, Free::kTurn);
  const double as_given = MeanCost(samples, given_model, scale),
               mirrored = MeanCost(other, mirrored_model, scale);
  std::vector<std::vector<Sample>> other_views;
  for (const auto& own : of_views) other_views.push_back(Mirrored(own));
  fit.correction.mirrored = BetterBy(of_views, given_model, other_views, mirrored_model, scale) > kSigmas;
  if (fit.correction.mirrored) {
    samples = other;
    of_views = std::move(other_views);
  }
  Model model = BestFit(samples, scale, Free::kBoth);
  fit.doubtful = mirrored < kDoubtfulMirrored * as_given ||
                 std::abs(model.turn) / 2 * 180 / kPi > kDoubtfulTurnDeg ||
                 std::hypot(model.bias_p, model.bias_q) > kDoubtfulBias;
  Spread spread = SpreadOfViews(of_views, model, scale, Free::kBoth);
  const auto matters = [](double value, double sigma, double least) {
    return std::abs(value) > std::max(least, kSigmas * sigma);
  };
  const bool bias = matters(std::hypot(model.bias_p, model.bias_q), spread.bias, kLeastBias);
  if (!bias) {  // it would take something from the turn
    model = BestFit(samples, scale, Free::kTurn);
    spread = SpreadOfViews(of_views, model, scale, Free::kTurn);
  }
  const double turn_deg = model.turn / 2 * 180 / kPi;
  const Model no_turn = bias ? BestFit(samples, scale, Free::kBias) : Model();
  if (matters(turn_deg, spread.turn / 2 * 180 / kPi, kLeastTurnDeg) &&
      BetterBy(of_views, no_turn, of_views, model, scale) > kSigmas)
    fit.correction.turn_deg = turn_deg;
  if (bias) {
    if (fit.correction.turn_deg == 0) model = BestFit(samples, scale, Free::kBias);
    fit.correction.bias_s1 = model.bias_p;
    fit.correction.bias_s2 = fit.correction.mirrored ? -model.bias_q : model.bias_q;
  }
  return fit;
}

PolarizationCorrection RefinedTurn(const Workspace& workspace, const MapKind& kind, int halvings,
                                   Progress& progress) {
  PolarizationCorrection correction = workspace.correction;
  const std::vector<Sample> samples = Together(SamplesOfViews(workspace, kind, halvings, progress));
  if (samples.size() < kEnough) return correction;
  correction.turn_deg += Fitted(samples, {}, ScaleOf(samples), Free::kTurn).turn / 2 * 180 / kPi;
  return correction;
}

std::string CorrectionWords(const PolarizationCorrection& c) {
  std::vector<std::string> wrong;
  if (c.mirrored) wrong.push_back("counted the other way (clockwise)");
  if (c.turn_deg != 0) wrong.push_back(fmt::format("turned by {:.1f} degrees", -c.turn_deg));
  if (c.bias_s1 != 0 || c.bias_s2 != 0)
    wrong.push_back(
        fmt::format("bent by gains of the four angles that differ (S1 by {:.2g}, S2 by {:.2g} of S0)",
                    c.bias_s1, c.bias_s2));
  if (wrong.empty()) return "";
  std::string text;
  for (std::size_t i = 0; i < wrong.size(); ++i)
    text += (i == 0 ? "" : i + 1 < wrong.size() ? ", " : " and ") + wrong[i];
  return "the angles of polarization do not fit the shape that the views agree on: they are " + text +
         " in all views. Stereo corrects that (--no-fit-polarization: not)";
}

}  // namespace polarscan
