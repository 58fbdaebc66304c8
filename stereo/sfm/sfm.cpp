// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/sfm.h"

#include <fmt/format.h>

#include <numbers>
#include <set>

#include "core/error.h"
#include "core/files/files.h"
#include "stereo/sfm/adjust_poses.h"
#include "stereo/sfm/board/board_scale.h"
#include "stereo/sfm/check_poses.h"
#include "stereo/sfm/colmap/mapping.h"
#include "stereo/sfm/feature_masks.h"
#include "stereo/sfm/known_poses.h"
#include "stereo/sfm/model/camera_models.h"
#include "stereo/sfm/scene_points.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kExhaustiveLimit = 40;  // pictures: 780 pairs
constexpr double kLoosePx = 16;  // error of a point that is kept while poses are only nearly right
constexpr double kTightPx = 4;   // and in the end: COLMAP's own limit
constexpr int kSmallPart = 3;    // pictures that make a model of their own in the end

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

// Images of other names than ours cannot come from our database.
void CheckNames(const std::vector<SparseModel>& models, const std::vector<ListedView>& views,
                const fs::path& where) {
  std::set<std::string> ours;
  for (const ListedView& view : views) ours.insert(view.PictureName());
  for (const SparseModel& model : models)
    for (const auto& [id, image] : model.images)
      if (!ours.contains(image.name))
        throw Error(fmt::format("COLMAP's model names a picture that it was not given: {}", image.name),
                    where.string(), "Remove this folder and run the same command again");
}

// Of each model but the first the pictures that are not in the first, where they are two at least.
std::vector<std::vector<std::string>> PiecesOf(const std::vector<SparseModel>& models) {
  std::vector<std::vector<std::string>> pieces;
  std::set<std::string> placed;
  for (std::size_t i = 0; i < models.size(); ++i) {
    std::vector<std::string> piece;
    for (const auto& [id, image] : models[i].images)
      if (i == 0 || !placed.contains(image.name)) piece.push_back(image.name);
    if (i == 0)
      placed = {piece.begin(), piece.end()};
    else if (piece.size() > 1)
      pieces.push_back(std::move(piece));
  }
  return pieces;
}

// On a scene that is mostly a plane the mapper can settle in a wrong focal length: points then miss their
// features. Another start finds the right one.
std::vector<SparseModel> TryOtherFocalLengths(const Mapping& m, std::vector<SparseModel> found) {
  const auto doubtful = [](const SparseModel& model) { return MeanError(model) > kDoubtfulError; };
  if (m.options.focal_px > 0) return found;
  for (const MappingAttempt& attempt : {MappingAttempt{"long-lens", 2.4}, MappingAttempt{"wide-lens", 0.7}}) {
    if (found.empty() || !doubtful(found[0])) break;
    m.progress.Info(fmt::format("the points miss their features by {:.1f} px; another attempt with a {}",
                                MeanError(found[0]),
                                attempt.focal_factor > 1 ? "longer lens" : "wider lens"));
    std::vector<SparseModel> models = MapViews(m, attempt);
    if (models.empty()) continue;
    const bool as_many = models[0].images.size() >= found[0].images.size();
    if (!models[0].images.empty() && !doubtful(models[0]) && as_many) found = std::move(models);
  }
  return found;
}

bool IsSound(const Mapping& m, const std::vector<SparseModel>& found) {
  const SparseModel best = BestOf(found);
  return RegisteredShare(best, m.views) >= kGoodShare && HasMoved(best);
}

// The last resort where the pictures have masks: hands and the like move against the object, but do not stand
// still. Taken if it places more views, or if the cameras had hardly moved.
void TryInsideMasks(const Mapping& m, const std::string& matcher, std::vector<SparseModel>& found,
                    Evidence& evidence) {
  if (m.options.masks != "auto" || IsSound(m, found) || !DropFeaturesOutsideOfMasks(m)) return;
  m.progress.Info(fmt::format("{} of {} views placed; another attempt with features inside of the masks only",
                              BestOf(found).images.size(), m.views.size()));
  try {
    MatchFeatures(m, matcher);
  } catch (const Error&) {  // there are no matches inside of the masks
    return;
  }
  std::vector<SparseModel> models = MapViews(m, {"inside-masks"});
  const std::size_t before = HasMoved(BestOf(found)) ? BestOf(found).images.size() : 0;
  if (BestOf(models).images.size() <= before || !HasMoved(BestOf(models))) return;
  found = std::move(models);
  evidence = {.images = ReadDatabase(m), .masked = true};
}

// How many of the views are in none of the models.
std::size_t CountUnplaced(const std::vector<SparseModel>& models, const std::vector<ListedView>& views) {
  std::set<std::string> placed;
  for (const SparseModel& model : models)
    for (const auto& [id, image] : model.images) placed.insert(image.name);
  return views.size() - placed.size();
}

// The pictures of the largest part that hangs together by pairs with as many matches as COLMAP needs to place
// one picture by another.
std::size_t LargestPart(const std::map<std::string, DatabaseImage>& images) {
  constexpr int kEnough = 30;
  std::set<std::string> reached;
  std::size_t largest = 0;
  for (const auto& [first, unused] : images) {
    std::vector<std::string> part;
    if (reached.insert(first).second) part.push_back(first);
    for (std::size_t i = 0; i < part.size(); ++i)
      for (const auto& [partner, matches] : images.at(part[i]).partners)
        if (matches >= kEnough && images.contains(partner) && reached.insert(partner).second)
          part.push_back(partner);
    largest = std::max(largest, part.size());
  }
  return largest;
}

// The least size of a model in the first attempts: COLMAP makes smaller ones again and again and throws them
// away, which where all parts are small takes long and leaves nothing.
int LeastPart(const Mapping& m) {
  const int usual = MappingAttempt().least;
  return LargestPart(ReadDatabase(m)) < std::min(std::size_t(usual), m.views.size()) ? kSmallPart : usual;
}

// Tries what costs little first: as asked; then all pairs, if only neighbours were matched; then lower
// thresholds; then small parts too; then only what is inside of masks; then other focal lengths.
SparseModel EstimateByColmap(const Mapping& m, Evidence& evidence) {
  ExtractFeatures(m);
  const bool automatic = m.options.matcher == "auto";
  const bool few = m.views.size() <= kExhaustiveLimit;
  std::string matcher = !automatic ? m.options.matcher : few ? "exhaustive" : "sequential";
  MatchMaskedFeatures(m, matcher);
  int least = LeastPart(m);
  std::vector<SparseModel> found = MapViews(m, {.name = "first", .least = least});
  const auto is_good = [&] { return RegisteredShare(BestOf(found), m.views) >= kGoodShare; };
  const auto improve = [&](const MappingAttempt& attempt) {
    m.progress.Info(
        fmt::format("{} of {} views placed; another attempt", BestOf(found).images.size(), m.views.size()));
    std::vector<SparseModel> models = MapViews(m, attempt);
    const std::size_t before = HasMoved(BestOf(found)) ? BestOf(found).images.size() : 0;
    if (HasMoved(BestOf(models)) && BestOf(models).images.size() > before) std::swap(found, models);
    found.insert(found.end(), models.begin(), models.end());  // they tell what hangs together
  };
  if (!IsSound(m, found) && automatic && !few) {
    MatchMaskedFeatures(m, matcher = "exhaustive");
    least = LeastPart(m);
    improve({.name = "all-pairs", .least = least});
  }
  if (!is_good()) improve({.name = "lenient", .lenient = true, .least = least});
  if (!is_good() && least > kSmallPart && CountUnplaced(found, m.views) >= std::size_t(kSmallPart))
    improve({.name = "parts", .least = kSmallPart});
  evidence = {.images = ReadDatabase(m), .masked = m.options.masks == "yes"};
  if (!IsSound(m, found)) evidence.still_background = MeasureVerifiedStillness(m).IsBackground();
  TryInsideMasks(m, matcher, found, evidence);
  found = TryOtherFocalLengths(m, std::move(found));
  CheckNames(found, m.views, m.folder / "models");
  evidence.pieces = PiecesOf(found);
  return BestOf(found);
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
  }
  const Eigen::Vector3d offset = model.offset;
  if (!known_model || NeedsColmap(options)) {
    fs::remove(log);
    Colmap colmap(options.colmap, log, progress);
    const Mapping mapping{views,   fs::absolute(views_folder), fs::absolute(sfm_folder), options, colmap,
                          progress};
    model = known_model ? Triangulate(mapping, model) : EstimateByColmap(mapping, evidence);
    model.offset = offset;  // COLMAP's answer knows of none
  }
  if (known_model)
    CheckKnownPoses(model, known_model->lexically_normal().string(), options.bundle_adjustment, progress);
  else
    CheckEstimatedPoses(model, views, evidence, options.min_registered, log.string(), progress);
  const LengthUnit unit = TakeUnitOfBoard(model, board, known_model && options.board == "auto", progress);
  WriteResult(sfm_folder / "model", hash, model, views.size(), unit);
  return model;
}

}  // namespace polarscan
