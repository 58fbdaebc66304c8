// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/polarizer/light_refinement.h"

#include <ceres/tiny_solver.h>
#include <ceres/tiny_solver_autodiff_function.h>
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "core/error.h"
#include "core/statistics.h"
#include "demosaic/calibration/polarizer/factorization.h"
#include "demosaic/calibration/response.h"

namespace polarscan {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;

constexpr Eigen::Index kFewestToDoubt = 9;  // frames
constexpr double kDoubtful = 5;             // standard deviations
constexpr double kGross = 4;                // times what is doubtful
constexpr double kCauchy = 2.4;             // standard deviations: 95 % efficient for normal errors
constexpr double kGauge = 1e3;              // weight of what nothing measures
constexpr double kSmallestDeviation = 1e-5;

// What a frame misses: the polarizer's degree; its angle (sine of twice the difference), or the brightness
// (share).
constexpr int kKinds = 2;
constexpr std::array<double, kKinds> kUnknowns = {5, 3};  // of the matrix, that each kind of misses fixes
constexpr std::array<double, kKinds> kNegligible = {3e-3, 1e-2};  // misses that are never doubtful
using Deviations = std::array<double, kKinds>;
using Misses = Eigen::Matrix<double, kKinds, Eigen::Dynamic>;

template <class T>
Eigen::Matrix<T, kKinds, 1> MissOf(const Eigen::Matrix<T, 3, 1>& light, const PolarizerKnowledge& known,
                                   Eigen::Index k) {
  using std::log, std::sqrt;
  const T polarized = sqrt(light[1] * light[1] + light[2] * light[2] + 1e-20);
  const T degree = polarized / light[0] - known.degree;
  if (!known.angles_deg) return {degree, light[0] > 0.0 ? T(log(light[0])) : T(light[0] - 1.0)};
  const double turn = 2 * kRadPerDeg * (*known.angles_deg)[std::size_t(k)];
  return {degree, (light[2] * std::cos(turn) - light[1] * std::sin(turn)) / polarized};
}

Misses MissesOf(const Matrix3Xd& light, const PolarizerKnowledge& known) {
  Misses misses(kKinds, light.cols());
  for (Eigen::Index k = 0; k < light.cols(); ++k) misses.col(k) = MissOf<double>(light.col(k), known, k);
  return misses;
}

// The frames' misses over their deviations as a function of the relative change of the light's matrix, row
// by row.
class LightTerms {
 public:
  LightTerms(const Matrix3Xd& light, const PolarizerKnowledge& known, const std::vector<bool>& counts,
             const Deviations& deviations, bool robust)
      : light_(light), known_(known), counts_(counts), deviations_(deviations), robust_(robust) {}

  int NumResiduals() const { return kKinds * int(light_.cols()) + 2; }

  template <class T>
  bool operator()(const T* x, T* residuals) const {
    const Eigen::Map<const Eigen::Matrix<T, 3, 3, Eigen::RowMajor>> change(x);
    for (Eigen::Index k = 0; k < light_.cols(); ++k) {
      const Eigen::Matrix<T, 3, 1> before = light_.col(k).cast<T>();
      const Eigen::Matrix<T, 3, 1> light = before + change * before;
      const Eigen::Matrix<T, kKinds, 1> miss = MissOf<T>(light, known_, k);
      for (int kind = 0; kind < kKinds; ++kind)
        residuals[kKinds * k + kind] =
            counts_[std::size_t(k)] ? Robust(T(miss[kind] / deviations_[std::size_t(kind)])) : T(0.0);
    }
    // Given angles leave the scale open, unknown ones the turn.
    residuals[NumResiduals() - 2] = known_.angles_deg ? T(kGauge * (x[0] + x[4] + x[8])) : T(0.0);
    residuals[NumResiduals() - 1] = known_.angles_deg ? T(0.0) : T(kGauge * (x[5] - x[7]));
    return true;
  }

 private:
  // Its square is Cauchy's cost.
  template <class T>
  T Robust(const T& residual) const {
    using std::log, std::sqrt;
    if (!robust_) return residual;
    const T share = residual * residual / (kCauchy * kCauchy) + 1e-12;
    return residual * sqrt(log(1.0 + share) / share);
  }

  const Matrix3Xd& light_;
  const PolarizerKnowledge& known_;
  const std::vector<bool>& counts_;
  const Deviations deviations_;
  const bool robust_;
};
using LightFunction = ceres::TinySolverAutoDiffFunction<LightTerms, Eigen::Dynamic, 9>;

// Of misses that count; robust: by their median.
Deviations DeviationsOf(const Misses& misses, const std::vector<bool>& counts, bool robust) {
  Deviations deviations;
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    std::vector<double> sizes;
    double squares = 0;
    for (Eigen::Index k = 0; k < misses.cols(); ++k) {
      if (!counts[std::size_t(k)]) continue;
      sizes.push_back(std::abs(misses(Eigen::Index(kind), k)));
      squares += sizes.back() * sizes.back();
    }
    const double n = double(sizes.size()), free = std::max(1.0, n - kUnknowns[kind]);
    const double found = robust ? 1.4826 * Median(sizes) * std::sqrt(n / free) : std::sqrt(squares / free);
    deviations[kind] = std::max(found, kSmallestDeviation);
  }
  return deviations;
}

// Median brightness 1.
void NormalizeBrightness(const Matrix3Xd& space, Matrix3d& matrix) {
  const Eigen::RowVectorXd brightness = (matrix * space).row(0);
  const double usual = Median({brightness.begin(), brightness.end()});
  if (usual > 0) matrix /= usual;
}

// That start that most frames fit best.
Matrix3d BestStart(const Matrix3Xd& space, const PolarizerKnowledge& known) {
  const Eigen::Index frames = space.cols(), most = MostDoubts(frames) > 0 ? frames : 0;
  const std::vector<bool> all(std::size_t(frames), true);
  std::optional<Matrix3d> best;
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index without = -1; without < most; ++without) {
    std::vector<Eigen::Index> others;
    PolarizerKnowledge said = known;
    if (said.angles_deg) said.angles_deg->clear();
    for (Eigen::Index k = 0; k < frames; ++k) {
      if (k == without) continue;
      others.push_back(k);
      if (said.angles_deg) said.angles_deg->push_back((*known.angles_deg)[std::size_t(k)]);
    }
    try {
      Matrix3d matrix = LightByAlgebra(space(Eigen::all, others), said);
      NormalizeBrightness(space, matrix);
      const Deviations d = DeviationsOf(MissesOf(matrix * space, known), all, true);
      if (d[0] * d[1] < least) least = d[0] * d[1], best = matrix;
    } catch (const Error&) {  // these frames are not enough
    }
  }
  return best ? *best : LightByAlgebra(space, known);
}

struct LightProblem {
  const Matrix3Xd& space;
  const PolarizerKnowledge& known;
  std::vector<bool> counts;

  Misses MissesBy(const Matrix3d& matrix) const { return MissesOf(matrix * space, known); }

  // A few rounds of deviations and matrix.
  void Refine(Matrix3d& matrix, bool robust) const {
    for (int round = 0; round < 3; ++round) {
      const Deviations deviations = DeviationsOf(MissesBy(matrix), counts, robust);
      const Matrix3Xd light = matrix * space;
      const LightTerms terms(light, known, counts, deviations, robust);
      ceres::TinySolver<LightFunction> solver;
      solver.options.function_tolerance = 1e-10;
      Eigen::Matrix<double, 9, 1> change = Eigen::Matrix<double, 9, 1>::Zero();
      solver.Solve(LightFunction(terms), &change);
      const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> relative(change.data());
      if (!change.allFinite()) return;
      matrix = (Matrix3d::Identity() + relative) * matrix;
    }
  }

  Eigen::Matrix<double, 9, 9> Covariance(const Matrix3d& matrix) const {
    const Matrix3Xd light = matrix * space;
    const LightTerms terms(light, known, counts, DeviationsOf(MissesBy(matrix), counts, false), false);
    const Eigen::Matrix<double, 9, 1> none = Eigen::Matrix<double, 9, 1>::Zero();
    Eigen::VectorXd residuals(terms.NumResiduals());
    Eigen::Matrix<double, Eigen::Dynamic, 9> jacobian(terms.NumResiduals(), 9);
    LightFunction function(terms);
    function(none.data(), residuals.data(), jacobian.data());
    const Eigen::Matrix<double, 9, 9> normal = jacobian.transpose() * jacobian;
    return normal.ldlt().solve(Eigen::Matrix<double, 9, 9>::Identity());
  }

  // How many times more than is likely each frame misses, by the deviations of those that count.
  std::vector<double> Excesses(const Matrix3d& matrix, bool robust) const {
    const Misses misses = MissesBy(matrix);
    const Deviations deviations = DeviationsOf(misses, counts, robust);
    std::vector<double> excesses(counts.size(), 0.0);
    for (Eigen::Index k = 0; k < misses.cols(); ++k)
      for (std::size_t kind = 0; kind < kKinds; ++kind) {
        const double likely = std::max(kDoubtful * deviations[kind], kNegligible[kind]);
        double& excess = excesses[std::size_t(k)];
        excess = std::max(excess, std::abs(misses(Eigen::Index(kind), k)) / likely);
      }
    return excesses;
  }
};

// All frames but the worst of those with an excess, as many as may be left out.
std::vector<bool> WithoutWorst(const std::vector<double>& excesses) {
  std::vector<double> sorted = excesses;
  std::ranges::sort(sorted, std::greater());
  const int most = MostDoubts(Eigen::Index(excesses.size()));
  const double least = most > 0 ? std::max(1.0, sorted[std::size_t(most)]) : sorted[0];
  std::vector<bool> counts;
  for (const double excess : excesses) counts.push_back(excess <= least);
  return counts;
}

std::string WordsOf(const Eigen::Vector3d& light, const PolarizerKnowledge& known, Eigen::Index k) {
  const Eigen::Vector2d miss = MissOf<double>(light, known, k);
  if (known.angles_deg && std::abs(miss[1]) > kNegligible[1]) {
    const double given = (*known.angles_deg)[std::size_t(k)];
    return fmt::format("it shows {:.1f} degrees where {:g} was said",
                       given + std::asin(miss[1]) / 2 / kRadPerDeg, given);
  }
  if (!known.angles_deg && std::abs(miss[1]) > kNegligible[1])
    return fmt::format("it is {:.1f} % {} than the others", 100 * std::abs(std::expm1(miss[1])),
                       miss[1] < 0 ? "darker" : "brighter");
  return fmt::format(
      "its light has a degree of polarization of {:.3f}, the others' {:.3f}: the polarizer moved during the "
      "exposure, "
      "or other light fell in",
      miss[0] + known.degree, known.degree);
}

}  // namespace

int MostDoubts(Eigen::Index frames) { return frames < kFewestToDoubt ? 0 : std::max(1, int(frames / 10)); }

RefinedLight RefineLight(const Matrix3Xd& space, const PolarizerKnowledge& known) {
  LightProblem problem{space, known, std::vector<bool>(std::size_t(space.cols()), true)};
  RefinedLight refined;
  refined.matrix = BestStart(space, known);
  problem.Refine(refined.matrix, true);
  const std::vector<double> excesses = problem.Excesses(refined.matrix, true);
  const auto gross = std::ranges::count_if(excesses, [](double excess) { return excess > kGross; });
  for (int round = 0; gross <= MostDoubts(space.cols()) && round < 3; ++round) {
    std::vector<bool> counts = WithoutWorst(round == 0 ? excesses : problem.Excesses(refined.matrix, false));
    if (round > 0 && counts == problem.counts) break;
    problem.counts = std::move(counts);
    problem.Refine(refined.matrix, false);
  }
  refined.covariance = problem.Covariance(refined.matrix);
  for (Eigen::Index k = 0; k < space.cols(); ++k)
    if (!problem.counts[std::size_t(k)])
      refined.doubts.push_back({int(k), "", WordsOf(refined.matrix * space.col(k), known, k), false});
  return refined;
}

}  // namespace polarscan
