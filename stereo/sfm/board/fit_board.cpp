// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/board/fit_board.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>

#include "core/random.h"
#include "core/statistics.h"
#include "stereo/sfm/board/board_points.h"
#include "stereo/sfm/model/lens_projection.h"

namespace polarscan {
namespace {

constexpr int kTrials = 300, kFitRounds = 4;
constexpr double kCauchyAtNormal = 2.385;  // deviations: 95 % efficient for normal errors
constexpr double kMadToSigma = 1.17741;    // median length of a normal miss in 2D, in sigmas: sqrt(2 ln 2)
constexpr double kLeastMiss_px = 0.02;     // of the misses' sigma: pictures are no better

// world_from_board: logarithm of the scale, rotation vector, translation.
using BoardPlace = std::array<double, 7>;

struct CornerTerm {
  const BoardCamera& camera;
  const BoardObservation& observation;

  template <class T>
  bool operator()(const T* place, T* residuals) const {
    using std::exp;
    const T scale = exp(place[0]);
    const Eigen::Vector3d& b = observation.on_board;
    const T scaled[3] = {scale * b.x(), scale * b.y(), scale * b.z()};
    T world[3];
    ceres::AngleAxisRotatePoint(place + 1, scaled, world);
    const Eigen::Matrix<T, 3, 1> p =
        camera.cam_from_world.rotation.cast<T>() *
            Eigen::Matrix<T, 3, 1>(world[0] + place[4], world[1] + place[5], world[2] + place[6]) +
        camera.cam_from_world.translation.cast<T>();
    if (!(p[2] > 0.0)) return false;
    Eigen::Map<Eigen::Matrix<T, 2, 1>> out(residuals);
    out = ProjectThrough(camera.lens, p.data()) - observation.at;
    return true;
  }
};

BoardPlace ToPlace(const Similarity& world_from_board) {
  BoardPlace place{};
  place[0] = std::log(world_from_board.scale);
  ceres::RotationMatrixToAngleAxis(world_from_board.rotation.data(), place.data() + 1);
  Eigen::Map<Eigen::Vector3d>(place.data() + 4) = world_from_board.translation;
  return place;
}

Similarity ToSimilarity(const BoardPlace& place) {
  Similarity result;
  result.scale = std::exp(place[0]);
  ceres::AngleAxisToRotationMatrix(place.data() + 1, result.rotation.data());  // column-major, as Eigen's
  result.translation = Eigen::Map<const Eigen::Vector3d>(place.data() + 4);
  return result;
}

Similarity Inverse(const Similarity& s) {
  Similarity inverse{1 / s.scale, s.rotation.transpose(), {}};
  inverse.translation = -inverse.scale * (inverse.rotation * s.translation);
  return inverse;
}

// Lengths of the misses, px; infinite behind a camera.
std::vector<double> MissesOf(const std::vector<BoardCamera>& cameras,
                             const std::vector<BoardObservation>& observations,
                             const Similarity& world_from_board) {
  std::vector<double> misses;
  for (const BoardObservation& o : observations) {
    const auto shown = Shown(cameras[std::size_t(o.camera)], world_from_board * o.on_board);
    misses.push_back(shown ? (*shown - o.at).norm() : std::numeric_limits<double>::infinity());
  }
  return misses;
}

std::size_t CountBelow(const std::vector<double>& values, double limit) {
  return std::size_t(std::ranges::count_if(values, [&](double value) { return value < limit; }));
}

// world_from_board by the three points that most observations fit.
std::optional<Similarity> StartOfFit(const std::vector<BoardCamera>& cameras,
                                     const std::vector<BoardObservation>& observations, double limit_px) {
  std::vector<BoardPoint> points;
  for (const auto& [name, point] : TriangulateBoard(cameras, observations, limit_px)) points.push_back(point);
  std::optional<Similarity> best;
  std::size_t most = 0;
  for (int trial = 0; points.size() >= 3 && trial < kTrials; ++trial) {
    Random random(0, std::uint64_t(trial));
    std::vector<Eigen::Vector3d> board, world;
    for (int i = 0; i < 3; ++i) {
      const BoardPoint& point = points[random.Below(std::uint32_t(points.size()))];
      board.push_back(point.on_board), world.push_back(point.in_world);
    }
    const Eigen::Vector3d a = board[1] - board[0], b = board[2] - board[0];
    if (a.cross(b).norm() < 0.1 * a.norm() * b.norm() + 1e-9 || (world[1] - world[0]).norm() == 0) continue;
    try {
      const Similarity similarity = EstimateSimilarity(board, world);
      const std::size_t fit = CountBelow(MissesOf(cameras, observations, similarity), limit_px);
      if (!best || fit > most) best = similarity, most = fit;
    } catch (const std::exception&) {  // the three lie on one line in the world
      continue;
    }
  }
  return best;
}

// The problem at its solution.
class BoardProblem {
 public:
  BoardProblem(const std::vector<BoardCamera>& cameras, const std::vector<BoardObservation>& observations,
               const Similarity& start)
      : cameras_(cameras), observations_(observations), place_(ToPlace(start)) {}

  // Least squares under Cauchy's loss of width `kCauchyAtNormal` times the misses' spread, found anew each time.
  bool Solve() {
    for (int round = 0; round < kFitRounds; ++round) {
      Build();
      ceres::Solver::Options options;
      options.linear_solver_type = ceres::DENSE_QR;
      options.logging_type = ceres::SILENT;
      ceres::Solver::Summary summary;
      ceres::Solve(options, problem_.get(), &summary);
      if (!summary.IsSolutionUsable()) return false;
    }
    return true;
  }
  Similarity world_from_board() const { return ToSimilarity(place_); }
  double sigma_px() const { return sigma_px_; }

  // Relative deviation of the scale: see FitBoard.
  double ScaleSigma() {
    std::map<int, std::vector<ceres::ResidualBlockId>> by_camera;
    for (std::size_t i = 0; i < blocks_.size(); ++i) by_camera[observations_[i].camera].push_back(blocks_[i]);
    using Matrix7 = Eigen::Matrix<double, 7, 7>;
    Matrix7 inverse;
    ceres::Covariance::Options options;
    options.algorithm_type = ceres::DENSE_SVD;
    options.null_space_rank = -1;
    ceres::Covariance covariance(options);
    const std::vector<const double*> parameters = {place_.data()};
    if (!covariance.Compute(parameters, problem_.get())) return 1;
    covariance.GetCovarianceMatrix(parameters, inverse.data());
    Matrix7 spread = Matrix7::Zero();
    for (const auto& [camera, blocks] : by_camera) {
      ceres::Problem::EvaluateOptions part;
      part.residual_blocks = blocks;
      std::vector<double> gradient;
      problem_->Evaluate(part, nullptr, nullptr, &gradient, nullptr);
      const Eigen::Map<const Eigen::Matrix<double, 7, 1>> g(gradient.data());
      spread += g * g.transpose();
    }
    const double views = double(by_camera.size());
    const double by_views = (inverse * spread * inverse)(0, 0) * views / std::max(1.0, views - 1);
    const double by_misses = inverse(0, 0) * sigma_px_ * sigma_px_;
    return std::sqrt(std::max(by_views, by_misses));
  }

 private:
  void Build() {
    const double median = Median(MissesOf(cameras_, observations_, world_from_board()));
    sigma_px_ = std::max(kLeastMiss_px, median / kMadToSigma);
    problem_ = std::make_unique<ceres::Problem>();
    blocks_.clear();
    for (const BoardObservation& o : observations_)
      blocks_.push_back(problem_->AddResidualBlock(new ceres::AutoDiffCostFunction<CornerTerm, 2, 7>(
                                                       new CornerTerm{cameras_[std::size_t(o.camera)], o}),
                                                   new ceres::CauchyLoss(kCauchyAtNormal * sigma_px_),
                                                   place_.data()));
  }

  const std::vector<BoardCamera>& cameras_;
  const std::vector<BoardObservation>& observations_;
  BoardPlace place_;
  double sigma_px_ = 1;
  std::unique_ptr<ceres::Problem> problem_;
  std::vector<ceres::ResidualBlockId> blocks_;
};

}  // namespace

std::optional<BoardFit> FitBoard(const std::vector<BoardCamera>& cameras,
                                 const std::vector<BoardObservation>& observations, double limit_px) {
  const auto start = StartOfFit(cameras, observations, limit_px);
  if (!start) return {};
  BoardProblem problem(cameras, observations, *start);
  BoardFit fit;
  const bool solved = problem.Solve();
  const Similarity found = solved ? problem.world_from_board() : *start;
  fit.board_from_world = Inverse(found);
  fit.scale_sigma = solved ? problem.ScaleSigma() : 1;
  const std::vector<double> misses = MissesOf(cameras, observations, found);
  double sum = 0;
  for (const double miss : misses) sum += miss < limit_px ? miss * miss : 0;
  const std::size_t count = CountBelow(misses, limit_px);
  fit.rms_px = std::sqrt(sum / double(std::max<std::size_t>(1, count)));
  fit.inliers = double(count) / double(std::max<std::size_t>(1, misses.size()));
  return fit;
}

}  // namespace polarscan
