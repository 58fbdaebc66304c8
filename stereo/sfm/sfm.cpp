// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/sfm.h"

#include <fmt/format.h>

#include <functional>
#include <numbers>
#include <set>

#include "core/error.h"
#include "core/files/files.h"
#include "stereo/sfm/adjust_poses.h"
#include "stereo/sfm/board/board_scale.h"
#include "stereo/sfm/board/poses_by_board.h"
#include "stereo/sfm/check_poses.h"
#include "stereo/sfm/colmap/mapping.h"
#include "stereo/sfm/features/feature_masks.h"
#include "stereo/sfm/features/poses_by_features.h"
#include "stereo/sfm/known_poses.h"
#include "stereo/sfm/model/camera_models.h"
#include "stereo/sfm/scene_points.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;
constexpr double kLoosePx = 16;           // error of a point that is kept while poses are only nearly right
constexpr std::size_t kManyCorners = 12;  // of a board in each view: enough for its pose
constexpr double kTightPx = 4;            // and in the end: COLMAP's own limit

// With known poses.
bool NeedsColmap(const SfmOptions& options) { return options.triangulate || options.bundle_adjustment; }

// Hash of pictures, masks, known model and options: all that the result depends on.
std::string ResultHash(const fs::path& folder, const std::vector<ListedView>& views,
                       const std::optional<fs::path>& known, const SfmOptions& options) {
  std::uint64_t hash = Hash(ToText(ValuesOf(options)) + (options.bundle_adjustment ? " 2" : " 1"));
  for (const ListedView& view : views) hash = HashFile(folder / view.PictureName(), Hash(view.name, hash));
  if (options.masks != "no" && (!known || NeedsColmap(options)))
    for (const ListedView& view : views)
      if (const fs::path mask = folder / "masks" / view.PictureName(); fs::exists(mask))
        hash = HashFile(mask, Hash(view.name, hash));
  if (!known) return ToHex(hash);
  const fs::path model = FindSparseModel(*known);
  for (const char* name : {"cameras", "images", "points3D"})
    for (const char* extension : {".bin", ".txt"})
      if (const fs::path file = model / (std::string(name) + extension); fs::exists(file))
        hash = HashFile(file, Hash(file.filename().string(), hash));
  return ToHex(hash);
}

// Hash of the model's own files.
std::string ModelHash(const fs::path& folder) {
  std::uint64_t hash = 0;
  for (const char* name : {"cameras.bin", "images.bin", "points3D.bin"}) hash = HashFile(folder / name, hash);
  if (fs::exists(folder / "offset.txt")) hash = HashFile(folder / "offset.txt", hash);
  return ToHex(hash);
}

// The result of an earlier run, if it was made from the same things and is as it was written.
std::optional<SparseModel> ReadResult(const fs::path& folder, const std::string& hash) {
  try {
    if (!fs::exists(folder / "result.json")) return {};
    const nlohmann::json result = ReadJson(folder / "result.json");
    if (result.value("hash", "") != hash || result.value("model", "") != ModelHash(folder)) return {};
    return ReadSparseModel(folder);
  } catch (const std::exception&) {  // damaged: it is made again
    return {};
  }
}

// result.json goes first and comes last: without it the model does not count.
void WriteResult(const fs::path& folder, const std::string& hash, const SparseModel& model, std::size_t views,
                 const LengthUnit& unit) {
  fs::remove(folder / "result.json");
  fs::remove(folder / "offset.txt");
  WriteSparseModelBinary(folder, model);
  nlohmann::json result = {{"hash", hash},
                           {"model", ModelHash(folder)},
                           {"views", views},
                           {"registered", model.images.size()},
                           {"points", model.points.size()},
                           {"mean_error_px", MeanError(model)}};
  if (unit.IsKnown()) result["unit"] = ToJson(unit);
  WriteJson(folder / "result.json", result);
}

// Known poses made to fit the pictures: points that fit the poses only nearly, then both together.
SparseModel AdjustKnownPoses(const Mapping& m, const SparseModel& known) {
  SparseModel model = TriangulatePoints(m, known, kLoosePx);
  if (model.images.size() != known.images.size() || model.points.empty()) {
    m.progress.Warn(
        "COLMAP could not triangulate points to adjust the poses by: they are taken as they were given");
    return known;
  }
  const AdjustmentFigures found = AdjustPoses(model, known, kTightPx, m.progress);
  m.progress.Info(
      fmt::format("bundle adjustment of {} points moved the cameras by {:.2g} rms, {:.2g} at most; "
                  "the given poses are right to about {:.2g} and {:.2g} degrees",
                  model.points.size(), found.moved_rms, found.moved_max, found.centre,
                  found.rotation_rad * 180 / std::numbers::pi));
  return model;
}

SparseModel Triangulate(const Mapping& m, const SparseModel& known) {
  ExtractFeatures(m);
  MatchMaskedFeatures(m, m.views.size() <= kExhaustiveLimit ? "exhaustive" : "sequential");
  if (m.options.bundle_adjustment) return AdjustKnownPoses(m, known);
  const SparseModel model = TriangulatePoints(m, known);
  if (model.images.size() == known.images.size()) return model;
  m.progress.Warn("COLMAP could not triangulate points; the depth ranges come from cameras and masks");
  return known;
}

// Where the board alone is asked for, or shows well in all views: then features add little.
std::optional<SparseModel> PosesByBoardAlone(const std::vector<ListedView>& views,
                                             const BoardSightings& board, const SfmOptions& options,
                                             const fs::path& where, Progress& progress) {
  if (options.poses_from == "features") return {};
  auto model = PosesByBoard(views, board, options, progress);
  if (options.poses_from == "board") {
    if (model) return model;
    throw Error(
        "poses cannot be had from a board alone: three pictures of one size and one camera at least must "
        "show "
        "eight of its corners each",
        where.string(), "Leave out --poses-from board, or take pictures that show more of the board");
  }
  if (!model || model->images.size() < views.size() || FewestCorners(board) < kManyCorners ||
      !HasMoved(*model))
    return {};
  progress.Info(
      fmt::format("poses by the board alone, which shows {} corners or more in each view (--poses-from "
                  "features takes those of the "
                  "pictures, too)",
                  FewestCorners(board)));
  return model;
}

// By features, or where these place few views and the board places more, by the board.
SparseModel FeaturesOrBoard(const std::vector<ListedView>& views, const BoardSightings& board,
                            const SfmOptions& options, Evidence& evidence, Progress& progress,
                            const std::function<SparseModel()>& by_features) {
  SparseModel model;
  std::optional<SparseModel> by_board;
  if (options.poses_from == "auto") by_board = PosesByBoard(views, board, options, progress);
  if (by_board && !HasMoved(*by_board)) by_board.reset();
  try {
    model = by_features();
  } catch (const Error& error) {
    if (!by_board) throw;
    progress.Info("no poses by the pictures' features: " + error.happened());
  }
  const std::size_t placed = HasMoved(model) ? model.images.size() : 0;
  if (!by_board || RegisteredShare(model, views) >= kGoodShare || by_board->images.size() <= placed)
    return model;
  progress.Info(fmt::format("poses by the board alone: it places {} views, features {}",
                            by_board->images.size(), placed));
  evidence = Evidence();
  evidence.by_board = true;
  return *by_board;
}

}  // namespace

OptionTable Table(SfmOptions& o) {
  return {
      {"camera-model",
       &o.camera_model,
       "lens model to estimate; two focal lengths (PINHOLE, OPENCV) go wrong on flat scenes",
       "",
       0,
       0,
       {"SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV"}},
      {"single-camera", &o.single_camera,
       "all pictures come from one camera with one setting of lens and focus"},
      {"focal", &o.focal_px, "focal length if known, to start from; 0: unknown", "px", 0, 1e6},
      {"matcher",
       &o.matcher,
       "which pictures are compared: all pairs, or neighbours in the order of names; auto: all pairs up to "
       "40 pictures",
       "",
       0,
       0,
       {"auto", "exhaustive", "sequential"}},
      {"max-features", &o.max_features, "features a picture: more finds more poses and costs time", "", 100,
       100000},
      {"sfm-max-image-size", &o.max_image_size,
       "features are searched in pictures of at most this size: time and memory", "px", 100, 20000},
      {"min-registered", &o.min_registered, "share of views that must be placed", "", 0, 1},
      {"sfm-masks",
       &o.masks,
       "features that poses are taken from where there are masks: all (no), those inside (yes), or all but "
       "what stands still outside while the object turns, and those inside if that fails (auto); without "
       "masks: all, or "
       "all but what stands still (auto)",
       "",
       0,
       0,
       {"auto", "yes", "no"}},
      {"board", &o.board,
       "printed board (polarscan board) that gives millimetres and a frame: auto (an A4 or A3 one where "
       "there "
       "is one; known poses keep their frame), no, yes (it must be there), or which: A4, A3, "
       "COLUMNSxROWS:SQUARE"},
      {"board-square", &o.board_square_mm,
       "side of its squares as measured after printing; 0: as they were meant", "mm", 0, 1000},
      {"poses-from",
       &o.poses_from,
       "features of the pictures (COLMAP), the board's corners alone, or auto: features, and the board where "
       "they "
       "place too few views",
       "",
       0,
       0,
       {"auto", "features", "board"}},
      {"triangulate", &o.triangulate,
       "with known poses: triangulate sparse points (slower; depth ranges also come from masks)"},
      {"bundle-adjustment", &o.bundle_adjustment,
       "with known poses that are only nearly right: adjust them to the pictures (implies --triangulate)"},
      {"sfm-seed", &o.seed, "random numbers of COLMAP", "", 0, 2147483647},
      {"colmap", &o.colmap, "COLMAP's program, a name or a path"},
  };
}

SparseModel EstimatePoses(const fs::path& views_folder, const fs::path& sfm_folder,
                          const std::optional<fs::path>& known_model, const SfmOptions& options,
                          Progress& progress) {
  SfmOptions checked = options;
  Validate(Table(checked));
  const std::vector<ListedView> views = ListViews(views_folder);
  const std::string hash = ResultHash(views_folder, views, known_model, options);
  if (const auto done = ReadResult(sfm_folder / "model", hash)) return *done;
  CreateFolder(sfm_folder);

  const BoardSightings board =
      BoardFor(views_folder, views, options.board, options.board_square_mm, progress);
  SparseModel model;
  Evidence evidence;
  const fs::path log = sfm_folder / "colmap.log";
  if (known_model) {
    model = ReadKnownPoses(*known_model, views, progress);
    MoveToLocalFrame(model, progress);
  } else if (auto alone = PosesByBoardAlone(views, board, options, views_folder, progress)) {
    model = std::move(*alone);
    evidence.by_board = true;
  }
  if (!evidence.by_board && (!known_model || NeedsColmap(options))) {
    fs::remove(log);
    const Eigen::Vector3d offset = model.offset;
    const auto with_colmap = [&](auto&& act) {
      Colmap colmap(options.colmap, log, progress);
      return act(
          Mapping{views, fs::absolute(views_folder), fs::absolute(sfm_folder), options, colmap, progress});
    };
    model = known_model
                ? with_colmap([&](const Mapping& m) { return Triangulate(m, model); })
                : FeaturesOrBoard(views, board, options, evidence, progress, [&] {
                    return with_colmap([&](const Mapping& m) { return PosesByFeatures(m, evidence); });
                  });
    model.offset = offset;  // COLMAP's answer knows of none
  }
  if (known_model)
    CheckKnownPoses(model, known_model->lexically_normal().string(), options.bundle_adjustment, progress);
  else
    CheckEstimatedPoses(model, views, evidence, options.min_registered, log.string(), progress);
  const BoardUse use = !known_model              ? BoardUse::kAdjust
                       : options.board == "auto" ? BoardUse::kTell
                                                 : BoardUse::kTake;
  const LengthUnit unit = TakeUnitOfBoard(model, board, use, progress);
  WriteResult(sfm_folder / "model", hash, model, views.size(), unit);
  return model;
}

}  // namespace polarscan
