// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/board/poses_by_board.h"

#include <algorithm>
#include <map>
#include <opencv2/calib3d.hpp>

#include "core/statistics.h"
#include "stereo/sfm/board/adjust_with_board.h"
#include "stereo/sfm/model/camera_models.h"

namespace polarscan {
namespace {

constexpr std::size_t kLeastSeen = 8;   // corners of a view
constexpr std::size_t kLeastViews = 3;  // that a focal length can be had from
constexpr double kUnusual = 6;          // times the usual miss: a view that does not belong to the others

struct SeenView {
  const ListedView* view = nullptr;
  const BoardSighting* sighting = nullptr;
};

std::vector<SeenView> ViewsThatShow(const std::vector<ListedView>& views, const BoardSightings& sightings) {
  std::vector<SeenView> seen;
  for (const BoardSighting& sighting : sightings.views) {
    const auto view = std::ranges::find(views, sighting.view, &ListedView::name);
    if (view != views.end() && sighting.corners.size() >= kLeastSeen) seen.push_back({&*view, &sighting});
  }
  return seen;
}

// What cv::calibrateCamera finds; OpenCV counts pixels from the middle of the first.
struct BoardCalibration {
  double focal = 0, k1 = 0;
  std::vector<cv::Mat> turns, shifts;
  std::vector<double> misses;  // of each view, px rms
};

BoardCalibration Calibrate(const std::vector<SeenView>& seen, const Board& board, double focal_px) {
  std::vector<std::vector<cv::Point3f>> points;
  std::vector<std::vector<cv::Point2f>> shown;
  for (const SeenView& view : seen) {
    points.emplace_back(), shown.emplace_back();
    for (const SeenCorner& corner : view.sighting->corners) {
      const Eigen::Vector3d on_board = board.Corner(corner.corner);
      points.back().emplace_back(float(on_board.x()), float(on_board.y()), float(on_board.z()));
      shown.back().emplace_back(float(corner.at.x() - 0.5), float(corner.at.y() - 0.5));
    }
  }
  const cv::Size size(seen[0].view->width, seen[0].view->height);
  cv::Mat matrix = cv::initCameraMatrix2D(points, shown, size, 1), distortion;
  if (focal_px > 0) matrix.at<double>(0, 0) = matrix.at<double>(1, 1) = focal_px;
  BoardCalibration result;
  cv::Mat of_lens, of_views, misses;
  cv::calibrateCamera(
      points, shown, size, matrix, distortion, result.turns, result.shifts, of_lens, of_views, misses,
      cv::CALIB_USE_INTRINSIC_GUESS | cv::CALIB_FIX_ASPECT_RATIO | cv::CALIB_FIX_PRINCIPAL_POINT |
          cv::CALIB_ZERO_TANGENT_DIST | cv::CALIB_FIX_K2 | cv::CALIB_FIX_K3);
  result.focal = matrix.at<double>(0, 0), result.k1 = distortion.at<double>(0);
  result.misses.assign(misses.begin<double>(), misses.end<double>());
  return result;
}

ColmapCamera ToCamera(const BoardCalibration& found, const std::string& model, int width, int height) {
  ColmapCamera camera{1, model, width, height, {found.focal}};
  if (FocalLengths(model) == 2) camera.params.push_back(found.focal);
  camera.params.insert(camera.params.end(), {0.5 * width, 0.5 * height});
  const auto count = std::size_t(FindCameraModel(model)->parameters);
  if (camera.params.size() < count) camera.params.push_back(found.k1);
  camera.params.resize(count, 0);
  return camera;
}

Rigid ToPose(const cv::Mat& turn, const cv::Mat& shift) {
  cv::Mat rotation;
  cv::Rodrigues(turn, rotation);
  Rigid pose;
  for (int i = 0; i < 9; ++i) pose.rotation(i / 3, i % 3) = rotation.at<double>(i / 3, i % 3);
  for (int i = 0; i < 3; ++i) pose.translation[i] = shift.at<double>(i);
  return pose;
}

// The corners as points, seen where they were seen.
SparseModel ToModel(const std::vector<SeenView>& seen, const Board& board, const BoardCalibration& found,
                    const std::string& camera_model) {
  SparseModel model;
  model.cameras[1] = ToCamera(found, camera_model, seen[0].view->width, seen[0].view->height);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto id = std::uint32_t(i + 1);
    ColmapImage image{id, 1, ToPose(found.turns[i], found.shifts[i]), seen[i].view->PictureName(), {}};
    for (const SeenCorner& corner : seen[i].sighting->corners) {
      const auto point = std::uint64_t(corner.corner + 1);
      ColmapPoint& entry = model.points[point];
      entry.position = board.Corner(corner.corner);
      entry.rgb = {128, 128, 128};
      entry.track.push_back({id, std::uint32_t(image.observations.size())});
      image.observations.push_back({corner.at.x(), corner.at.y(), std::int64_t(point)});
    }
    model.images[id] = std::move(image);
  }
  return model;
}

}  // namespace

std::optional<SparseModel> PosesByBoard(const std::vector<ListedView>& views, const BoardSightings& sightings,
                                        const SfmOptions& options, const Progress& progress) try {
  if (!sightings.board || !sightings.problem.empty() || !options.single_camera) return {};
  std::vector<SeenView> seen = ViewsThatShow(views, sightings);
  if (seen.size() < kLeastViews || std::ranges::any_of(seen, [&](const SeenView& v) {
        return v.view->width != seen[0].view->width || v.view->height != seen[0].view->height;
      }))
    return {};
  BoardCalibration found = Calibrate(seen, *sightings.board, options.focal_px);
  const double most = kUnusual * Median(found.misses);
  std::vector<SeenView> usual;
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (found.misses[i] <= most) usual.push_back(seen[i]);
  if (usual.size() < kLeastViews) return {};
  if (usual.size() < seen.size()) found = Calibrate(seen = usual, *sightings.board, options.focal_px);
  SparseModel model = ToModel(seen, *sightings.board, found, options.camera_model);
  AdjustWithBoard(model, sightings, progress);
  return model;
} catch (const cv::Exception&) {  // the views do not determine a camera
  return {};
}

std::size_t FewestCorners(const BoardSightings& sightings) {
  std::size_t fewest = sightings.views.empty() ? 0 : sightings.views[0].corners.size();
  for (const BoardSighting& view : sightings.views) fewest = std::min(fewest, view.corners.size());
  return fewest;
}

}  // namespace polarscan
