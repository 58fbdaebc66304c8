// SPDX-License-Identifier: Apache-2.0
#include "fake_colmap.h"

#include <fmt/format.h>
#include <sqlite3.h>

namespace polarscan {
namespace {

constexpr const char* kProgram =
    "#!/bin/sh\n"
    "cd \"$(dirname \"$0\")\"\n"
    "command=$1; shift\n"
    "if [ \"$command\" = help ]; then echo \"COLMAP RELEASE -- Structure-from-Motion and Multi-ListedView "
    "Stereo\"; exit 0; fi\n"
    "if [ \"$1\" = -h ]; then cat options; exit 0; fi\n"
    "echo \"$command $*\" >> calls\n"
    "while [ $# -gt 1 ]; do\n"
    "  case $1 in --database_path) database=$2;; --output_path) output=$2;; esac\n"
    "  shift 2\n"
    "done\n"
    "if [ -f $command.sh ]; then . ./$command.sh; fi\n";

constexpr const char* kCommon[] = {"database_path",
                                   "image_path",
                                   "image_list_path",
                                   "output_path",
                                   "input_path",
                                   "ImageReader.camera_model",
                                   "ImageReader.single_camera",
                                   "ImageReader.camera_params",
                                   "SiftExtraction.max_num_features",
                                   "SequentialMatching.overlap"};
constexpr const char* k38[] = {"random_seed",
                               "SiftExtraction.use_gpu",
                               "SiftExtraction.num_threads",
                               "SiftMatching.use_gpu",
                               "SiftMatching.num_threads",
                               "Mapper.ba_global_use_pba",
                               "SiftExtraction.max_image_size"};
constexpr const char* k40[] = {"Mapper.random_seed",
                               "FeatureExtraction.use_gpu",
                               "FeatureExtraction.num_threads",
                               "FeatureMatching.use_gpu",
                               "FeatureMatching.num_threads",
                               "Mapper.ba_use_gpu",
                               "FeatureExtraction.max_image_size"};

std::string Help(const std::string& release) {
  std::string text =
      "Options can either be specified via command-line or a file passed to `--project_path`.\n";
  for (const char* name : kCommon) text += fmt::format("  --{} arg (=0)\n", name);
  for (const char* name : release == "3.8" ? k38 : k40) text += fmt::format("  --{} arg (=1)\n", name);
  return text;
}  // namespace

}  // namespace

SparseModel WithPoint(SparseModel model) {
  if (!model.points.empty()) return model;
  ColmapPoint point{{0, 0, 0}, {}, 0.4, {}};
  for (auto& [id, image] : model.images) {
    if (image.observations.empty()) image.observations.resize(1);
    point.track.push_back({id, 0});
  }
  model.points[1] = point;
  return model;
}

FakeColmap::FakeColmap(const std::filesystem::path& folder, const std::string& release) : folder_(folder) {
  std::string program = kProgram;
  program.replace(program.find("RELEASE"), 7, release);
  WriteFileAtomically(folder / "colmap", program);
  std::filesystem::permissions(folder / "colmap", std::filesystem::perms::owner_all);
  WriteFileAtomically(folder / "options", Help(release));
}

void FakeColmap::ExtractorWrites(const std::vector<std::string>& names, int keypoints, int matched) {
  std::string sql =
      "CREATE TABLE images (image_id INTEGER, name TEXT, camera_id INTEGER);"
      "CREATE TABLE keypoints (image_id INTEGER, rows INTEGER);"
      "CREATE TABLE two_view_geometries (pair_id INTEGER, rows INTEGER);" +
      descriptor_tables_;
  std::string matches;
  for (std::size_t i = 0; i < names.size(); ++i) {
    sql += fmt::format("INSERT INTO images VALUES ({}, '{}', 1);", i + 1, names[i]);
    sql += fmt::format("INSERT INTO keypoints VALUES ({}, {});", i + 1, keypoints);
    if (int(i) + 1 < matched)
      matches += fmt::format("INSERT INTO two_view_geometries VALUES ({}, {});", (i + 1) * 2147483647 + i + 2,
                             matches_);
  }
  sql += descriptors_;
  std::filesystem::remove(folder_ / "prepared.db");
  Change("prepared.db", sql);
  std::filesystem::copy_file(folder_ / "prepared.db", folder_ / "matched.db",
                             std::filesystem::copy_options::overwrite_existing);
  Change("matched.db", matches);
  On("feature_extractor", "[ -f $database ] || { cp prepared.db $database; echo anew >> extractions; }");
  for (const char* matcher : {"exhaustive_matcher", "sequential_matcher", "matches_importer"})
    On(matcher, "cp matched.db $database");
}

void FakeColmap::Change(const std::string& name, const std::string& sql) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open((folder_ / name).c_str(), &database), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(database);
}

void FakeColmap::ImportsMatches() {
  descriptor_tables_ = "CREATE TABLE descriptors (image_id INTEGER, rows INTEGER, cols INTEGER, data BLOB);";
  descriptors_ = "INSERT INTO descriptors SELECT image_id, 20, 128, randomblob(20 * 128) FROM images;";
  ListsOption("match_list_path");
  ListsOption("match_type");
}

void FakeColmap::ListsOption(const std::string& name) {
  WriteFileAtomically(folder_ / "options", ReadFile(folder_ / "options") + "  --" + name + " arg\n");
}

void FakeColmap::ExtractorGuessesFocalLength(int width, int height) {
  const std::string sql = fmt::format(
      "CREATE TABLE cameras (camera_id INTEGER, model INTEGER, width INTEGER, height INTEGER, params BLOB, "
      "prior_focal_length INTEGER); INSERT INTO cameras VALUES (1, 2, {}, {}, zeroblob(32), 0);",
      width, height);
  for (const char* name : {"prepared.db", "matched.db"}) Change(name, sql);
}

void FakeColmap::MapperWrites(const std::vector<SparseModel>& models) {
  std::filesystem::remove_all(folder_ / "models");
  for (std::size_t i = 0; i < models.size(); ++i)
    WriteSparseModelBinary(folder_ / "models" / std::to_string(i), WithPoint(models[i]));
  CreateFolder(folder_ / "models");
  On("mapper", "cp -r models/. $output");
}

}  // namespace polarscan
