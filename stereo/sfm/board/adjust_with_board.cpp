// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/board/adjust_with_board.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/statistics.h"
#include "stereo/sfm/model/camera_models.h"

namespace polarscan {
namespace {

constexpr int kAdjustRounds = 4, kRoundIterations = 12;
constexpr double kCauchyOfNormal = 2.4;  // deviations: 95 % efficient for normal errors
constexpr double kStartCorner_px = 0.3, kStartFeature_px = 1, kLeastDeviation_px = 0.02;
constexpr double kMostMiss_px = 1e3;  // of an observation that counts
constexpr std::size_t kDenseViews = 80;

// cam_from_world: rotation vector, translation.
using PoseNumbers = std::array<double, 6>;
// A lens: focal lengths in x and y, k1, k2, p1, p2.
using LensNumbers = std::array<double, 6>;

PoseNumbers ToNumbers(const Rigid& pose) {
  PoseNumbers numbers{};
  ceres::RotationMatrixToAngleAxis(pose.rotation.data(), numbers.data());  // column-major, as Eigen's
  Eigen::Map<Eigen::Vector3d>(numbers.data() + 3) = pose.translation;
  return numbers;
}

Rigid ToRigid(const PoseNumbers& numbers) {
  Rigid pose;
  ceres::AngleAxisToRotationMatrix(numbers.data(), pose.rotation.data());
  pose.translation = Eigen::Map<const Eigen::Vector3d>(numbers.data() + 3);
  return pose;
}

// Where the parameters of COLMAP's models stand in LensNumbers; -1: the principal point. A number that stands for two
// is a focal length of a model that has only one.
std::vector<int> PlacesOf(const std::string& model) {
  if (model == "SIMPLE_PINHOLE") return {0, -1, -1};
  if (model == "PINHOLE") return {0, 1, -1, -1};
  if (model == "SIMPLE_RADIAL") return {0, -1, -1, 2};
  if (model == "RADIAL") return {0, -1, -1, 2, 3};
  return {0, 1, -1, -1, 2, 3, 4, 5};  // OPENCV; FULL_OPENCV's others are 0 (ToLens)
}

// How an observation misses its point, over its deviation. tied: there is one focal length, the first.
struct MissTerm {
  Eigen::Vector2d principal, observed;
  bool tied = true;
  double deviation_px = 1;

  template <class T>
  bool operator()(const T* pose, const T* lens, const T* point, T* residuals) const {
    T p[3];
    ceres::AngleAxisRotatePoint(pose, point, p);
    for (int i = 0; i < 3; ++i) p[i] += pose[3 + i];
    if (!(p[2] > 0.0)) return false;
    const T x = p[0] / p[2], y = p[1] / p[2], r2 = x * x + y * y,
            radial = 1.0 + r2 * (lens[2] + r2 * lens[3]);
    const T u = x * radial + 2.0 * lens[4] * x * y + lens[5] * (r2 + 2.0 * x * x);
    const T v = y * radial + lens[4] * (r2 + 2.0 * y * y) + 2.0 * lens[5] * x * y;
    residuals[0] = (lens[0] * u + principal.x() - observed.x()) / deviation_px;
    residuals[1] = ((tied ? lens[0] : lens[1]) * v + principal.y() - observed.y()) / deviation_px;
    return true;
  }
};

struct Sighted {
  std::uint32_t image_id = 0;
  Eigen::Vector2d at = Eigen::Vector2d::Zero();
  double* point = nullptr;
  bool is_corner = false;
};

class JointAdjustment {
 public:
  JointAdjustment(SparseModel& model, const BoardSightings& sightings) : model_(model) {
    for (const auto& [id, camera] : model.cameras) {
      const Lens lens = ToLens(camera);
      lenses_[id] = {lens.pinhole.fx, lens.pinhole.fy, lens.k1, lens.k2, lens.p1, lens.p2};
      principal_[id] = {lens.pinhole.cx, lens.pinhole.cy};
    }
    std::map<std::string, std::uint32_t> ids;
    for (const auto& [id, image] : model.images) {
      poses_[id] = ToNumbers(image.cam_from_world);
      ids[std::filesystem::path(image.name).stem().string()] = id;
    }
    for (auto& [id, point] : model.points)
      for (const ColmapPoint::Track& t : point.track) {
        const ColmapImage::Observation& o = model.images.at(t.image_id).observations[t.observation];
        sighted_.push_back({t.image_id, {o.x, o.y}, point.position.data(), false});
      }
    for (int i = 0; i < sightings.board->Corners(); ++i) corners_.push_back(sightings.board->Corner(i));
    for (const BoardSighting& view : sightings.views)
      if (const auto id = ids.find(view.view); id != ids.end())
        for (const SeenCorner& corner : view.corners)
          sighted_.push_back({id->second, corner.at, corners_[std::size_t(corner.corner)].data(), true});
  }

  BoardAdjustment Run(const Progress& progress) {
    for (int round = 0; round < kAdjustRounds; ++round) {
      progress.Check();
      Solve();
      FindDeviations();
    }
    found_.focal_sigma = FocalSigma();
    WriteBack();
    return found_;
  }

 private:
  void Fill(ceres::Problem& problem, bool features) {
    for (const Sighted& s : sighted_)
      if ((features || s.is_corner) && Miss(s) < kMostMiss_px) Add(problem, s);
    for (auto& [id, camera] : model_.cameras) HoldLens(problem, camera.model, lenses_.at(id).data());
    for (Eigen::Vector3d& corner : corners_)
      if (problem.HasParameterBlock(corner.data())) problem.SetParameterBlockConstant(corner.data());
  }

  // By the problem's curvature, corners alone: poses and lens may change together.
  double FocalSigma() {
    ceres::Problem problem;
    Fill(problem, false);
    ceres::Covariance::Options options;
    options.algorithm_type = ceres::DENSE_SVD;
    options.null_space_rank = -1;
    ceres::Covariance covariance(options);
    std::vector<std::pair<const double*, const double*>> blocks;
    for (const auto& [id, lens] : lenses_)
      if (problem.HasParameterBlock(lens.data())) blocks.emplace_back(lens.data(), lens.data());
    if (blocks.empty() || !covariance.Compute(blocks, &problem)) return 0;
    double largest = 0;
    for (const auto& [lens, same] : blocks) {
      Eigen::Matrix<double, 6, 6, Eigen::RowMajor> of_lens;
      covariance.GetCovarianceBlock(lens, same, of_lens.data());
      largest = std::max(largest, std::sqrt(of_lens(0, 0)) / lens[0]);
    }
    return largest;
  }

  void Solve() {
    ceres::Problem problem;
    Fill(problem, true);
    ceres::Solver::Options options;
    options.linear_solver_type = poses_.size() <= kDenseViews ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    options.max_num_iterations = kRoundIterations;
    options.initial_trust_region_radius = 1e6;  // the start is near
    options.function_tolerance = 1e-8;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
  }

  void Add(ceres::Problem& problem, const Sighted& s) {
    const std::uint32_t camera = model_.images.at(s.image_id).camera_id;
    auto* term = new MissTerm{principal_.at(camera), s.at, FocalLengths(model_.cameras.at(camera).model) == 1,
                              s.is_corner ? found_.corner_px : found_.feature_px};
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<MissTerm, 2, 6, 6, 3>(term),
                             new ceres::CauchyLoss(kCauchyOfNormal), poses_.at(s.image_id).data(),
                             lenses_.at(camera).data(), s.point);
  }

  static void HoldLens(ceres::Problem& problem, const std::string& model, double* lens) {
    if (!problem.HasParameterBlock(lens)) return;
    const std::vector<int> places = PlacesOf(model);
    std::vector<int> held;
    for (int i = 0; i < int(LensNumbers().size()); ++i)
      if (std::ranges::find(places, i) == places.end()) held.push_back(i);
    if (!held.empty()) problem.SetManifold(lens, new ceres::SubsetManifold(int(LensNumbers().size()), held));
  }

  Eigen::Vector2d MissOf(const Sighted& s) const {
    const std::uint32_t camera = model_.images.at(s.image_id).camera_id;
    const MissTerm term{principal_.at(camera), s.at, FocalLengths(model_.cameras.at(camera).model) == 1};
    Eigen::Vector2d miss(kMostMiss_px, kMostMiss_px);
    term(poses_.at(s.image_id).data(), lenses_.at(camera).data(), s.point, miss.data());
    return miss;
  }
  double Miss(const Sighted& s) const { return MissOf(s).norm(); }

  void FindDeviations() {
    std::vector<double> corners, features;
    for (const Sighted& s : sighted_) {
      const Eigen::Vector2d miss = MissOf(s);
      auto& of_kind = s.is_corner ? corners : features;
      of_kind.push_back(std::abs(miss.x())), of_kind.push_back(std::abs(miss.y()));
    }
    found_.corner_px = std::max(kLeastDeviation_px, 1.4826 * Median(std::move(corners)));
    found_.feature_px = std::max(kLeastDeviation_px, 1.4826 * Median(std::move(features)));
  }

  void WriteBack() {
    for (auto& [id, image] : model_.images) image.cam_from_world = ToRigid(poses_.at(id));
    for (auto& [id, camera] : model_.cameras) {
      const std::vector<int> places = PlacesOf(camera.model);
      for (std::size_t i = 0; i < places.size(); ++i)
        if (places[i] >= 0) camera.params[i] = lenses_.at(id)[std::size_t(places[i])];
    }
  }

  SparseModel& model_;
  std::map<std::uint32_t, LensNumbers> lenses_;
  std::map<std::uint32_t, Eigen::Vector2d> principal_;
  std::map<std::uint32_t, PoseNumbers> poses_;
  std::vector<Eigen::Vector3d> corners_;
  std::vector<Sighted> sighted_;
  BoardAdjustment found_{kStartCorner_px, kStartFeature_px};
};

}  // namespace

BoardAdjustment AdjustWithBoard(SparseModel& model, const BoardSightings& sightings,
                                const Progress& progress) {
  return JointAdjustment(model, sightings).Run(progress);
}

}  // namespace polarscan
