// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/adjust_poses.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "core/statistics.h"
#include "stereo/sfm/model/lens_projection.h"

namespace polarscan {
namespace {

constexpr int kRounds = 4, kIterations = 8;  // of deviations and poses; of the latter in each round
constexpr double kCauchyDeviations = 2.4;    // 95 % efficient for normal errors
constexpr double kStartRotation_rad = 0.05,
                 kStartCentre = 0.05;  // the latter in mean distances to the points
constexpr double kStartObservation_px = 1;
constexpr double kLeastObservation_px = 0.05, kLeastRotation_rad = 1e-7, kLeastCentre = 1e-7;
constexpr double kFarBehind = 1e3;  // px, of a point that is not in front of its camera
constexpr std::size_t kDenseCameras = 80;

// A pose: rotation vector after the given rotation (camera's axes) and shift of the given centre (world).
using PoseChange = std::array<double, 6>;

Rigid Changed(const Rigid& given, const PoseChange& change) {
  Eigen::Matrix3d turn;
  ceres::AngleAxisToRotationMatrix(change.data(), turn.data());  // column-major, as Eigen's
  const Eigen::Matrix3d rotation = turn * given.rotation;
  const Eigen::Vector3d centre = given.Center() + Eigen::Map<const Eigen::Vector3d>(change.data() + 3);
  return {rotation, -(rotation * centre)};
}

PoseChange ChangeBetween(const Rigid& given, const Rigid& pose) {
  PoseChange change{};
  const Eigen::Matrix3d turn = pose.rotation * given.rotation.transpose();
  ceres::RotationMatrixToAngleAxis(turn.data(), change.data());
  Eigen::Map<Eigen::Vector3d>(change.data() + 3) = pose.Center() - given.Center();
  return change;
}

// An observation's miss over its deviation, by pose change and point.
struct ObservationTerm {
  const Lens& lens;
  const Rigid& given;
  Eigen::Vector2d observed = Eigen::Vector2d::Zero();
  double deviation_px = 1;

  template <class T>
  bool operator()(const T* change, const T* point, T* residuals) const {
    const Eigen::Vector3d centre = given.Center();
    const Eigen::Matrix<T, 3, 1> from_centre(
        point[0] - centre[0] - change[3], point[1] - centre[1] - change[4], point[2] - centre[2] - change[5]);
    const Eigen::Matrix<T, 3, 1> before = given.rotation.cast<T>() * from_centre;
    T p[3];
    ceres::AngleAxisRotatePoint(change, before.data(), p);
    if (!(p[2] > 0.0)) return false;
    Eigen::Map<Eigen::Matrix<T, 2, 1>> out(residuals);
    out = (ProjectThrough(lens, p) - observed) / deviation_px;
    return true;
  }
};

// What a pose differs from the given one by over its deviation: rotation (first = 0) or centre (3).
struct GivenTerm {
  int first = 0;
  double deviation = 1;

  template <class T>
  bool operator()(const T* change, T* residuals) const {
    for (int i = 0; i < 3; ++i) residuals[i] = change[first + i] / deviation;
    return true;
  }
};

struct Observation {
  std::uint32_t image_id = 0, index = 0;  // the latter: in the image's observations
  std::uint64_t point_id = 0;
};

class Adjustment {
 public:
  Adjustment(SparseModel& model, const SparseModel& given) : model_(model) {
    std::map<std::string, Rigid> poses;
    for (const auto& [id, image] : given.images) poses[image.name] = image.cam_from_world;
    for (const auto& [id, camera] : model.cameras) lenses_[id] = ToLens(camera);
    for (const auto& [id, image] : model.images) {
      given_[id] = poses.at(image.name);
      changes_[id] = ChangeBetween(given_[id], image.cam_from_world);
    }
    double distance = 0;
    for (const auto& [id, point] : model.points)
      for (const ColmapPoint::Track& track : point.track) {
        observations_.push_back({track.image_id, track.observation, id});
        distance += (given_.at(track.image_id) * point.position).norm();
      }
    centre_ = kStartCentre * distance / double(std::max(std::size_t(1), observations_.size()));
  }

  // One solution by the deviations so far.
  void Solve() {
    ceres::Problem problem;
    for (const Observation& o : observations_)
      if (MissPx(o) < kFarBehind) AddObservation(problem, o);
    for (auto& [id, change] : changes_)
      for (const int first : {0, 3})
        problem.AddResidualBlock(new ceres::AutoDiffCostFunction<GivenTerm, 3, 6>(
                                     new GivenTerm{first, first == 0 ? rotation_rad_ : centre_}),
                                 new ceres::CauchyLoss(kCauchyDeviations), change.data());
    ceres::Solver::Options options;
    options.linear_solver_type = changes_.size() <= kDenseCameras ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    options.max_num_iterations = kIterations;
    options.initial_trust_region_radius = 1e6;  // the start is near
    options.function_tolerance = 1e-7;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
  }

  // As the errors look now. Seven of the poses' numbers, the world's place, turn and scale, were free.
  void FindDeviations() {
    std::vector<double> misses, turns, shifts;
    for (const Observation& o : observations_) {
      const Eigen::Vector2d miss = Miss(o);
      misses.push_back(std::abs(miss.x())), misses.push_back(std::abs(miss.y()));
    }
    for (const auto& [id, change] : changes_)
      for (std::size_t i = 0; i < 3; ++i)
        turns.push_back(std::abs(change[i])), shifts.push_back(std::abs(change[3 + i]));
    const double all = double(6 * changes_.size()), free = std::sqrt(all / std::max(1.0, all - 7));
    const double scale = centre_;
    observation_px_ = std::max(kLeastObservation_px, 1.4826 * Median(std::move(misses)));
    rotation_rad_ = std::max(kLeastRotation_rad, 1.4826 * free * Median(std::move(turns)));
    centre_ = std::max(kLeastCentre * scale, 1.4826 * free * Median(std::move(shifts)));
  }

  AdjustmentFigures Finish(double limit_px) {
    AdjustmentFigures figures{observation_px_, rotation_rad_, centre_};
    for (auto& [id, image] : model_.images) {
      image.cam_from_world = Changed(given_.at(id), changes_.at(id));
      const double moved = Eigen::Map<const Eigen::Vector3d>(changes_.at(id).data() + 3).norm();
      figures.moved_rms += moved * moved / double(model_.images.size());
      figures.moved_max = std::max(figures.moved_max, moved);
    }
    figures.moved_rms = std::sqrt(figures.moved_rms);
    figures.dropped = DropMisses(limit_px);
    return figures;
  }

 private:
  const ColmapImage& ImageOf(const Observation& o) const { return model_.images.at(o.image_id); }
  Eigen::Vector2d Observed(const Observation& o) const {
    const ColmapImage::Observation& at = ImageOf(o).observations[o.index];
    return {at.x, at.y};
  }

  Eigen::Vector2d Miss(const Observation& o) const {
    const Rigid pose = Changed(given_.at(o.image_id), changes_.at(o.image_id));
    const Eigen::Vector3d p = pose * model_.points.at(o.point_id).position;
    if (!(p.z() > 0)) return {2 * kFarBehind, 2 * kFarBehind};
    return ProjectThrough(lenses_.at(ImageOf(o).camera_id), p.data()) - Observed(o);
  }
  double MissPx(const Observation& o) const { return Miss(o).norm(); }

  void AddObservation(ceres::Problem& problem, const Observation& o) {
    const Lens& lens = lenses_.at(ImageOf(o).camera_id);
    auto* term = new ObservationTerm{lens, given_.at(o.image_id), Observed(o), observation_px_};
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<ObservationTerm, 2, 6, 3>(term),
                             new ceres::CauchyLoss(kCauchyDeviations), changes_.at(o.image_id).data(),
                             model_.points.at(o.point_id).position.data());
  }

  // Takes observations that miss by more out of the model, and points that are left with one; sets the
  // others' errors.
  int DropMisses(double limit_px) {
    const std::size_t before = observations_.size();
    std::size_t kept = 0;
    for (auto& [id, point] : model_.points) {
      point.error_px = 0;
      std::vector<ColmapPoint::Track> track;
      for (const ColmapPoint::Track& t : point.track)
        if (const double miss = MissPx({t.image_id, t.observation, id}); miss <= limit_px)
          track.push_back(t), point.error_px += miss;
      if (track.size() < 2) track.clear();
      point.error_px /= double(std::max(std::size_t(1), track.size()));
      kept += track.size();
      point.track = std::move(track);
    }
    std::erase_if(model_.points, [](const auto& entry) { return entry.second.track.empty(); });
    for (auto& [id, image] : model_.images)
      for (ColmapImage::Observation& o : image.observations) o.point_id = -1;
    for (const auto& [id, point] : model_.points)
      for (const ColmapPoint::Track& t : point.track)
        model_.images.at(t.image_id).observations[t.observation].point_id = std::int64_t(id);
    return int(before - kept);
  }

  SparseModel& model_;
  std::map<std::uint32_t, Lens> lenses_;
  std::map<std::uint32_t, Rigid> given_;
  std::map<std::uint32_t, PoseChange> changes_;
  std::vector<Observation> observations_;
  double observation_px_ = kStartObservation_px, rotation_rad_ = kStartRotation_rad, centre_ = 0;
};

}  // namespace

AdjustmentFigures AdjustPoses(SparseModel& model, const SparseModel& given, double limit_px,
                              const Progress& progress) {
  Adjustment adjustment(model, given);
  for (int round = 0; round < kRounds; ++round) {
    progress.Check();
    adjustment.Solve();
    adjustment.FindDeviations();
  }
  return adjustment.Finish(limit_px);
}

}  // namespace polarscan
