// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/sfm.h"

#include <fmt/format.h>

#include "core/error.h"
#include "core/files.h"
#include "stereo/sfm/bundle_adjustment.h"
#include "stereo/sfm/camera_models.h"
#include "stereo/sfm/known_poses.h"
#include "stereo/sfm/mapping.h"
#include "stereo/sfm/scene.h"
#include "stereo/sfm/verdict.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kExhaustiveLimit = 40;  // pictures: 780 pairs

// Hash of pictures, known model and options: all that the result depends on.
std::string ResultHash(const fs::path& folder, const std::vector<View>& views,
                       const std::optional<fs::path>& known, SfmOptions options) {
  std::uint64_t hash = Hash(ToText(ToJson(Table(options))) + " 1");
  for (const View& view : views) hash = HashFile(folder / view.PictureName(), Hash(view.name, hash));
  if (!known) return ToHex(hash);
  for (const char* name : {"cameras", "images", "points3D"})
    for (const char* extension : {".bin", ".txt"})
      if (const fs::path file = *known / (std::string(name) + extension); fs::exists(file))
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
void WriteResult(const fs::path& folder, const std::string& hash, const SparseModel& model,
                 std::size_t views) {
  fs::remove(folder / "result.json");
  fs::remove(folder / "offset.txt");
  WriteSparseModelBinary(folder, model);
  WriteJson(folder / "result.json", {{"hash", hash},
                                     {"model", ModelHash(folder)},
                                     {"views", views},
                                     {"registered", model.images.size()},
                                     {"points", model.points.size()},
                                     {"mean_error_px", MeanError(model)}});
}

// Images of other names than ours cannot come from our database.
void CheckNames(const SparseModel& model, const std::vector<View>& views, const fs::path& where) {
  for (const auto& [id, image] : model.images) {
    const bool known =
        std::ranges::any_of(views, [&](const View& view) { return view.PictureName() == image.name; });
    if (!known)
      throw Error(fmt::format("COLMAP's model names a picture that it was not given: {}", image.name),
                  where.string(), "Remove this folder and run the same command again");
  }
}

// On a scene that is mostly a plane the mapper can settle in a wrong focal length: points then miss their
// features. Another start finds the right one.
SparseModel TryOtherFocalLengths(const Mapping& m, SparseModel best) {
  const auto doubtful = [](const SparseModel& model) { return MeanError(model) > kDoubtfulError; };
  if (m.options.focal_px > 0) return best;
  for (const MappingAttempt& attempt : {MappingAttempt{"long-lens", 2.4}, MappingAttempt{"wide-lens", 0.7}}) {
    if (best.images.empty() || !doubtful(best)) break;
    m.progress.Info(fmt::format("the points miss their features by {:.1f} px; another attempt with a {}",
                                MeanError(best), attempt.focal_factor > 1 ? "longer lens" : "wider lens"));
    SparseModel model = MapViews(m, attempt);
    const bool as_many = model.images.size() >= best.images.size();
    if (!model.images.empty() && !doubtful(model) && as_many) best = std::move(model);
  }
  return best;
}

// Tries what costs little first: as asked; then all pairs, if only neighbours were matched; then lower
// thresholds; then other focal lengths.
SparseModel EstimateByColmap(const Mapping& m) {
  ExtractFeatures(m);
  const bool automatic = m.options.matcher == "auto";
  const bool few = m.views.size() <= kExhaustiveLimit;
  const std::string matcher = !automatic ? m.options.matcher : few ? "exhaustive" : "sequential";
  MatchFeatures(m, matcher);
  SparseModel best = MapViews(m, {"first"});
  const auto improve = [&](const MappingAttempt& attempt) {
    m.progress.Info(
        fmt::format("{} of {} views placed; another attempt", best.images.size(), m.views.size()));
    SparseModel model = MapViews(m, attempt);
    if (model.images.size() > best.images.size()) best = std::move(model);
  };
  if (RegisteredShare(best, m.views) < kGoodShare && automatic && !few) {
    MatchFeatures(m, "exhaustive");
    improve({"all-pairs"});
  }
  if (RegisteredShare(best, m.views) < kGoodShare) improve({.name = "lenient", .lenient = true});
  best = TryOtherFocalLengths(m, std::move(best));
  CheckNames(best, m.views, m.folder / "models");
  return best;
}

SparseModel Triangulate(const Mapping& m, const SparseModel& known) {
  ExtractFeatures(m);
  MatchFeatures(m, m.views.size() <= kExhaustiveLimit ? "exhaustive" : "sequential");
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
  const std::vector<View> views = ListViews(views_folder);
  const std::string hash = ResultHash(views_folder, views, known_model, options);
  if (const auto done = ReadResult(sfm_folder / "model", hash)) return *done;
  CreateFolder(sfm_folder);

  SparseModel model;
  std::map<std::string, DatabaseImage> database;
  const fs::path log = sfm_folder / "colmap.log";
  if (known_model) {
    model = SelectKnownPoses(ReadSparseModel(*known_model), views, known_model->string());
    MoveToLocalFrame(model, progress);
  }
  const Eigen::Vector3d offset = model.offset;
  if (!known_model || options.triangulate || options.bundle_adjustment) {
    fs::remove(log);
    Colmap colmap(options.colmap, log, progress);
    const Mapping mapping{views,   fs::absolute(views_folder), fs::absolute(sfm_folder), options, colmap,
                          progress};
    model = known_model ? Triangulate(mapping, model) : EstimateByColmap(mapping);
    database = ReadDatabase(mapping);
    model.offset = offset;  // COLMAP's answer knows of none
  }
  JudgePoses(model, views, database, known_model ? 0 : options.min_registered,
             (known_model ? *known_model : log).string(), progress);
  WriteResult(sfm_folder / "model", hash, model, views.size());
  return model;
}

}  // namespace polarscan
