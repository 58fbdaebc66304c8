// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/board/board_scale.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include "core/words.h"
#include "stereo/sfm/board/adjust_with_board.h"
#include "stereo/sfm/board/fit_board.h"

namespace polarscan {
namespace {

constexpr double kLimit_px = 2,
                 kLimitShare = 0.003;     // most that a corner may miss: px, of the picture's side
constexpr double kLeastInliers = 0.6;     // share of the corners that must keep to it
constexpr double kMostScaleSigma = 0.02;  // a unit known worse is none

// What the fit needs of the placed views that show the board.
struct PlacedSightings {
  std::vector<BoardCamera> cameras;
  std::vector<BoardObservation> observations;
  std::size_t corners = 0;  // different ones
  int longest_px = 0;       // side of the pictures
};

PlacedSightings PlacedOf(const SparseModel& model, const BoardSightings& sightings) {
  std::map<std::string, const ColmapImage*> images;
  for (const auto& [id, image] : model.images)
    images[std::filesystem::path(image.name).stem().string()] = &image;
  PlacedSightings placed;
  std::set<int> corners;
  for (const BoardSighting& sighting : sightings.views) {
    const auto image = images.find(sighting.view);
    if (image == images.end()) continue;
    const ColmapCamera& camera = model.cameras.at(image->second->camera_id);
    for (const SeenCorner& corner : sighting.corners) {
      placed.observations.push_back(
          {int(placed.cameras.size()), corner.corner, sightings.board->Corner(corner.corner), corner.at});
      corners.insert(corner.corner);
    }
    placed.cameras.push_back({ToLens(camera), image->second->cam_from_world});
    placed.longest_px = std::max({placed.longest_px, camera.width, camera.height});
  }
  placed.corners = corners.size();
  return placed;
}

std::string DoesNotFit(const Board& board, const std::optional<BoardFit>& fit, double limit_px) {
  const std::string how = fit ? fmt::format("{:.0f} % of its corners miss by more than {:.2g} px",
                                            100 * (1 - fit->inliers), limit_px)
                              : std::string("its corners have no place in space");
  return fmt::format(
      "the board {} does not fit the poses: {}. It stood still while the object turned, slipped, is bent, or "
      "is "
      "not of that size; lengths stay in arbitrary units",
      board.name, how);
}

std::string BoardText(const Board& board) {
  return fmt::format("board {} of {} mm squares", board.name, NumberText(board.square_mm, false));
}

}  // namespace

void Transform(SparseModel& model, const Similarity& target_from_world) {
  for (auto& [id, image] : model.images) image.cam_from_world = target_from_world(image.cam_from_world);
  for (auto& [id, point] : model.points) point.position = target_from_world * point.position;
  model.offset.setZero();
}

LengthUnit TakeUnitOfBoard(SparseModel& model, const BoardSightings& sightings, BoardUse use,
                           Progress& progress) {
  if (!sightings.board || !sightings.problem.empty()) return {};
  PlacedSightings placed = PlacedOf(model, sightings);
  const Board& board = *sightings.board;
  if (placed.cameras.size() < 2) {
    progress.Warn(
        fmt::format("the board {} is seen well in {} with a pose; two at least must show it, so lengths stay "
                    "in arbitrary units",
                    board.name, CountOf(placed.cameras.size(), "view")));
    return {};
  }
  const double limit_px = std::max(kLimit_px, kLimitShare * placed.longest_px);
  auto fit = FitBoard(placed.cameras, placed.observations, limit_px);
  if (!fit || fit->inliers < kLeastInliers || fit->scale_sigma > kMostScaleSigma) {
    progress.Warn(DoesNotFit(board, fit, limit_px));
    return {};
  }
  if (use != BoardUse::kTell) Transform(model, fit->board_from_world);
  if (use == BoardUse::kAdjust) {
    SparseModel adjusted = model;
    const BoardAdjustment found = AdjustWithBoard(adjusted, sightings, progress);
    placed = PlacedOf(adjusted, sightings);
    const auto again = FitBoard(placed.cameras, placed.observations, limit_px);
    if (again && again->inliers >= fit->inliers) {
      model = std::move(adjusted), fit = again;
      fit->scale_sigma = std::hypot(fit->scale_sigma, found.focal_sigma);
    }
  }
  const std::string how = fmt::format("{} corners in {} views, {:.2f} px rms", placed.corners,
                                      placed.cameras.size(), fit->rms_px);
  const std::string sigma = PercentText(fit->scale_sigma);
  if (use == BoardUse::kTell) {
    progress.Info(
        fmt::format("by the {}, a unit of the given poses is {:.5g} mm to {} ({}); --board yes takes its "
                    "millimetres and its frame",
                    BoardText(board), fit->board_from_world.scale, sigma, how));
    return {};
  }
  progress.Info(
      fmt::format("by the {}, lengths are in mm to {}, 1 sigma, without errors of the print ({}); z "
                  "is up from its middle",
                  BoardText(board), sigma, how));
  return {"mm", "board", fit->scale_sigma};
}

}  // namespace polarscan
