// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/colmap/mapping.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "core/error.h"
#include "core/files/files.h"
#include "core/words.h"
#include "stereo/sfm/model/camera_models.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;
constexpr int kOverlap = 10;  // neighbours on each side that "sequential" matches

std::string Threads(const SfmOptions& options) {
  if (options.threads > 0) return std::to_string(options.threads);
  return std::to_string(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

bool HasSingleCamera(const Mapping& m) {
  const ListedView& first = m.views[0];
  return m.options.single_camera && std::ranges::all_of(m.views, [&](const ListedView& view) {
           return view.width == first.width && view.height == first.height;
         });
}

// The camera's starting values from a known focal length, as COLMAP wants them: "f,cx,cy,0".
std::string StartingParameters(const SfmOptions& options, const ListedView& view) {
  const CameraModel* model = FindCameraModel(options.camera_model);
  const bool two = FocalLengths(options.camera_model) == 2;
  std::string text = fmt::format("{}", options.focal_px);
  if (two) text += fmt::format(",{}", options.focal_px);
  text += fmt::format(",{},{}", view.width / 2.0, view.height / 2.0);
  for (int i = two ? 4 : 3; i < model->parameters; ++i) text += ",0";
  return text;
}

std::vector<ColmapOption> ExtractionOptions(const Mapping& m) {
  const bool single = HasSingleCamera(m);
  if (m.options.single_camera && !single)
    m.progress.Warn("the pictures have different sizes, so each gets a camera of its own");
  std::vector<ColmapOption> options = {
      {{"database_path"}, m.database(), true},
      {{"image_path"}, m.pictures, true},
      {{"image_list_path"}, m.folder / "pictures.txt", true},
      {{"ImageReader.camera_model"}, m.options.camera_model, true},
      {{"ImageReader.single_camera"}, single ? "1" : "0", true},
      {{"ImageReader.single_camera_per_image"}, single ? "0" : "1"},
      {{"FeatureExtraction.use_gpu", "SiftExtraction.use_gpu"}, "0"},
      {{"FeatureExtraction.num_threads", "SiftExtraction.num_threads"}, Threads(m.options)},
      {{"FeatureExtraction.max_image_size", "SiftExtraction.max_image_size"},
       std::to_string(m.options.max_image_size)},
      {{"SiftExtraction.max_num_features"}, std::to_string(m.options.max_features)},
      {{"random_seed"}, std::to_string(m.options.seed)},
  };
  if (m.options.focal_px > 0 && single)
    options.push_back({{"ImageReader.camera_params"}, StartingParameters(m.options, m.views[0]), true});
  return options;
}

// Options that every mapper and triangulator gets.
std::vector<ColmapOption> MapperOptions(const Mapping& m, const fs::path& output) {
  return {{{"database_path"}, m.database(), true},
          {{"image_path"}, m.pictures, true},
          {{"output_path"}, output, true},
          {{"Mapper.num_threads"}, Threads(m.options)},
          {{"Mapper.ba_use_gpu", "Mapper.ba_global_use_pba"}, "0"},
          {{"Mapper.random_seed"}, std::to_string(m.options.seed)},
          {{"random_seed"}, std::to_string(m.options.seed)}};
}

// Hash of all that the features depend on.
std::string DatabaseHash(const Mapping& m) {
  const SfmOptions& o = m.options;
  std::uint64_t hash = Hash(fmt::format("1 {} {} {} {} {} {}", o.camera_model, o.single_camera, o.focal_px,
                                        o.max_features, o.max_image_size, m.colmap.version()));
  for (const ListedView& view : m.views)
    hash = HashFile(m.pictures / view.PictureName(), Hash(view.name, hash));
  return ToHex(hash);
}

// Whether the database in the folder can be gone on with.
bool IsUsable(const Mapping& m, const fs::path& note, const std::string& hash) {
  if (!fs::exists(m.database()) || !fs::exists(note)) return false;
  try {
    ReadDatabase(m);
    return ReadJson(note).value("hash", "") == hash;
  } catch (const std::exception&) {  // damaged by a power cut, say: it is only a cache
    return false;
  }
}

void CheckFeatures(const Mapping& m, int exit_code) {
  const std::string log = (m.folder / "colmap.log").string();
  std::map<std::string, DatabaseImage> images;
  if (fs::exists(m.database())) images = ReadDatabase(m);
  std::vector<std::string> unread;
  bool any = false;
  for (const ListedView& view : m.views) {
    const auto image = images.find(view.PictureName());
    if (image == images.end()) unread.push_back(view.PictureName());
    any = any || (image != images.end() && image->second.keypoints > 0);
  }
  if (!unread.empty())
    throw Error(
        fmt::format("COLMAP did not read {} of {} pictures ({}); exit code {}, last complaint: \"{}\"",
                    unread.size(), m.views.size(), Enumerate(unread), exit_code, m.colmap.Complaint()),
        log, "Check the pictures and the free memory and disk, then run the same command again");
  if (!any)
    throw Error(
        "COLMAP found no feature in any picture", log,
        "The pictures are too dark, too blurred or without texture: put a printed sheet under the object, or "
        "give known poses (sparse/ beside the pictures, all in one folder)");
}

std::vector<ColmapOption> MatcherOptions(const Mapping& m) {
  return {{{"database_path"}, m.database(), true},
          {{"FeatureMatching.use_gpu", "SiftMatching.use_gpu"}, "0"},
          {{"FeatureMatching.num_threads", "SiftMatching.num_threads"}, Threads(m.options)},
          {{"random_seed"}, std::to_string(m.options.seed)}};
}

// COLMAP's own matchers: search trees on the CPU.
int MatchByColmap(const Mapping& m, const std::string& matcher) {
  const bool exhaustive = matcher == "exhaustive";
  const int count = int(m.views.size()), block = std::max(5, (count + 3) / 4);
  const int blocks = (count + block - 1) / block;
  std::vector<ColmapOption> options = MatcherOptions(m);
  options.insert(options.end(), {{{"ExhaustiveMatching.block_size"}, std::to_string(block)},
                                 {{"SequentialMatching.overlap"}, std::to_string(kOverlap)},
                                 {{"SequentialMatching.quadratic_overlap"}, "1"},
                                 {{"SequentialMatching.loop_detection"}, "0"}});
  const std::size_t steps = exhaustive ? std::size_t(blocks * blocks) : m.views.size();
  return m.colmap.Run(matcher + "_matcher", options, "matching", steps,
                      exhaustive ? "Matching block" : "Matching image");
}

// Our own, faster matching, which COLMAP then only verifies; nothing if that is not possible (a COLMAP that
// cannot import matches, other features than SIFT, names with spaces).
std::optional<int> MatchByUs(const Mapping& m, const std::string& matcher) {
  if (!m.colmap.Knows("matches_importer", "match_list_path")) return {};
  const auto all = ReadDescriptors(m.database());
  std::vector<Descriptors> pictures;
  for (const ListedView& view : m.views) {
    const auto found = all.find(view.PictureName());
    if (found == all.end() || found->first.find_first_of(" \t") != std::string::npos) return {};
    pictures.push_back(found->second);
  }
  const int count = int(pictures.size());
  const auto pairs = matcher == "exhaustive" ? AllPairs(count) : NeighbourPairs(count, kOverlap);
  const fs::path list = m.folder / "matches.txt";
  WriteFileAtomically(list, MatchPairs(pictures, pairs, m.progress));
  std::vector<ColmapOption> options = MatcherOptions(m);
  options.push_back({{"match_list_path"}, list, true});
  options.push_back({{"match_type"}, "raw", true});
  return m.colmap.Run("matches_importer", options, "verifying matches", pairs.size(), "Elapsed");
}

}  // namespace

std::map<std::string, DatabaseImage> ReadDatabase(const Mapping& m) { return ReadDatabase(m.database()); }

void ExtractFeatures(const Mapping& m) {
  const fs::path note = m.database_note();
  const std::string hash = DatabaseHash(m);
  if (!IsUsable(m, note, hash)) {
    for (const char* suffix : {"", "-wal", "-shm"}) fs::remove(m.database().string() + suffix);
    WriteJson(note, {{"hash", hash}});
  }
  std::string list;
  for (const ListedView& view : m.views) list += view.PictureName() + "\n";
  WriteFileAtomically(m.folder / "pictures.txt", list);
  CheckFeatures(m, m.colmap.Run("feature_extractor", ExtractionOptions(m), "features", m.views.size(),
                                "Processed file ["));
  NormalizeDatabase(m.database(), HasSingleCamera(m));
}

void MatchFeatures(const Mapping& m, const std::string& matcher) {
  const int exit_code = MatchByUs(m, matcher).value_or(-1);
  const int code = exit_code >= 0 ? exit_code : MatchByColmap(m, matcher);
  const auto images = ReadDatabase(m);
  if (std::ranges::none_of(images, [](const auto& image) { return !image.second.partners.empty(); }))
    throw Error(fmt::format("COLMAP found no two pictures that match (exit code {}, last complaint: \"{}\")",
                            code, m.colmap.Complaint()),
                (m.folder / "colmap.log").string(),
                "Neighbouring pictures must overlap by about 75 % and show some texture: put a printed sheet "
                "under the object, take more pictures, or give known poses (sparse/ beside the pictures, all "
                "in one folder)");
}

std::vector<SparseModel> ReadModels(const fs::path& models, Progress& progress) {
  std::vector<SparseModel> found;
  if (!fs::is_directory(models)) return found;
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(models))
    if (entry.is_directory()) folders.push_back(entry.path());
  std::ranges::sort(folders);
  for (const fs::path& folder : folders) {
    try {
      found.push_back(ReadSparseModel(folder));
    } catch (const Error& problem) {
      progress.Warn(fmt::format("a model is skipped: {}", problem.what()));
    }
  }
  std::ranges::stable_sort(found, std::greater(), [](const SparseModel& model) {
    return std::pair(model.images.size(), model.points.size());
  });
  return found;
}

SparseModel BestOf(const std::vector<SparseModel>& models) {
  return models.empty() ? SparseModel() : models.front();
}

std::vector<SparseModel> MapViews(const Mapping& m, const MappingAttempt& attempt) {
  const fs::path output = m.folder / "models" / attempt.name;
  fs::remove_all(output);
  CreateFolder(output);
  if (m.options.focal_px <= 0) SetGuessedFocalLengths(m.database(), attempt.focal_factor);
  std::vector<ColmapOption> options = MapperOptions(m, output);
  options.push_back({{"Mapper.min_model_size"}, std::to_string(attempt.least)});
  if (attempt.lenient)
    options.insert(options.end(), {{{"Mapper.init_min_tri_angle"}, "5"},
                                   {{"Mapper.init_min_num_inliers"}, "40"},
                                   {{"Mapper.abs_pose_min_num_inliers"}, "15"},
                                   {{"Mapper.abs_pose_min_inlier_ratio"}, "0.15"},
                                   {{"Mapper.max_reg_trials"}, "6"}});
  m.colmap.Run("mapper", options, "poses", m.views.size(), "Registering ");
  return ReadModels(output, m.progress);
}

SparseModel TriangulatePoints(const Mapping& m, const SparseModel& known, double limit_px) {
  const auto images = ReadDatabase(m);
  SparseModel input;
  input.cameras = known.cameras;
  for (const auto& [id, image] : known.images) {
    const DatabaseImage& entry = images.at(image.name);  // image ids must be those of the database
    input.images[entry.id] = {entry.id, image.camera_id, image.cam_from_world, image.name, {}};
  }
  const fs::path folder = m.folder / "models" / "known", output = m.folder / "models" / "triangulated" / "0";
  fs::remove_all(output);
  CreateFolder(output);
  WriteSparseModelText(folder, input);
  std::vector<ColmapOption> options = MapperOptions(m, output);
  options.push_back({{"input_path"}, folder, true});
  options.push_back({{"clear_points"}, "1"});
  for (const char* limit :
       {"filter_max_reproj_error", "tri_merge_max_reproj_error", "tri_complete_max_reproj_error"})
    options.push_back({{std::string("Mapper.") + limit}, fmt::format("{}", limit_px)});
  m.colmap.Run("point_triangulator", options, "points", m.views.size(), "Triangulating image");
  return BestOf(ReadModels(output.parent_path(), m.progress));
}

}  // namespace polarscan
