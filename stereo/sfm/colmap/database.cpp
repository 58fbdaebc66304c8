// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/colmap/database.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "core/error.h"
#include "stereo/sfm/model/camera_models.h"

namespace polarscan {
namespace {

using Connection = std::unique_ptr<sqlite3, decltype(&sqlite3_close)>;
using Statement = std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)>;

[[noreturn]] void Fail(sqlite3* database, const std::filesystem::path& path) {
  throw Error(
      fmt::format("COLMAP's database cannot be read ({})", database ? sqlite3_errmsg(database) : "no memory"),
      path.string(), "Remove it and run the same command again");
}

// Calls row(statement) for each row of the query.
template <class F>
void Query(sqlite3* database, const std::filesystem::path& path, const char* query, F&& row) {
  sqlite3_stmt* raw = nullptr;
  if (sqlite3_prepare_v2(database, query, -1, &raw, nullptr) != SQLITE_OK) Fail(database, path);
  const Statement statement(raw, sqlite3_finalize);
  int result;
  while ((result = sqlite3_step(raw)) == SQLITE_ROW) row(raw);
  if (result != SQLITE_DONE) Fail(database, path);
}

Connection Open(const std::filesystem::path& path, int mode = SQLITE_OPEN_READONLY) {
  sqlite3* raw = nullptr;
  const int opened = sqlite3_open_v2(path.c_str(), &raw, mode, nullptr);
  Connection database(raw, sqlite3_close);
  if (opened != SQLITE_OK) Fail(raw, path);
  return database;
}

bool HasTable(sqlite3* database, const std::filesystem::path& path, const std::string& table) {
  bool has = false;
  Query(database, path, ("SELECT name FROM sqlite_master WHERE name = '" + table + "'").c_str(),
        [&](sqlite3_stmt*) { has = true; });
  return has;
}

void Execute(sqlite3* database, const std::filesystem::path& path, const std::string& statements) {
  if (sqlite3_exec(database, statements.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
    Fail(database, path);
}

// The statements, all of them or none.
void Change(sqlite3* database, const std::filesystem::path& path, const std::string& statements) {
  Execute(database, path, "PRAGMA foreign_keys = OFF; BEGIN IMMEDIATE;" + statements + "COMMIT;");
}

// Gives every `id` in the table the number that `numbers` (old, new) has for it; first out of the others'
// way.
std::string Renumber(const std::string& table, const std::string& id, const std::string& numbers) {
  return fmt::format(
      "UPDATE {0} SET {1} = 1000000000 + (SELECT new FROM {2} WHERE old = {1});"
      "UPDATE {0} SET {1} = {1} - 1000000000;",
      table, id, numbers);
}

constexpr const char* kOrder =
    "CREATE TEMP TABLE image_numbers AS SELECT image_id AS old, row_number() OVER (ORDER BY name) AS new "
    "FROM images;CREATE TEMP TABLE camera_numbers AS SELECT camera_id AS old, row_number() OVER (ORDER BY "
    "min(name)) AS new FROM images GROUP BY camera_id;DELETE FROM cameras WHERE camera_id NOT IN (SELECT old "
    "FROM camera_numbers);";

// The pictures' numbers in a pair's: smaller one * 2147483647 + larger one.
std::pair<std::uint32_t, std::uint32_t> PairOf(std::int64_t pair_id) {
  return {std::uint32_t(pair_id / 2147483647), std::uint32_t(pair_id % 2147483647)};
}

bool HasColumn(sqlite3* database, const std::filesystem::path& path, const char* table, const char* column) {
  bool has = false;
  Query(database, path,
        fmt::format("SELECT name FROM pragma_table_info('{}') WHERE name = '{}'", table, column).c_str(),
        [&](sqlite3_stmt*) { has = true; });
  return has;
}

// Rows of `size` bytes each in a column of the query's row.
struct Blob {
  const std::uint8_t* bytes = nullptr;
  std::size_t rows = 0, size = 0;

  template <class T>
  T Get(std::size_t row, std::size_t index) const {
    T value;
    std::memcpy(&value, bytes + row * size + index * sizeof(T), sizeof(T));
    return value;
  }
};
// The query's columns first, first + 1 and first + 2 are rows, cols, data; no rows if these do not fit, or
// hold less than two numbers of 32 bits.
Blob GetBlob(sqlite3_stmt* row, int first) {
  const auto rows = std::size_t(std::max<std::int64_t>(0, sqlite3_column_int64(row, first)));
  const auto* bytes = static_cast<const std::uint8_t*>(sqlite3_column_blob(row, first + 2));
  const std::size_t count = std::size_t(sqlite3_column_bytes(row, first + 2));
  if (rows == 0 || count % rows != 0 || count / rows < 8) return {};
  return {bytes, rows, count / rows};
}

// The rows that stay, one after the other.
std::string Kept(const Blob& blob, const std::vector<bool>& dropped) {
  std::string bytes;
  for (std::size_t i = 0; i < blob.rows; ++i)
    if (i >= dropped.size() || !dropped[i])
      bytes.append(reinterpret_cast<const char*>(blob.bytes) + i * blob.size, blob.size);
  return bytes;
}

// Replaces rows and data of a picture in `table`.
void ReplaceRows(sqlite3* database, const std::filesystem::path& path, const std::string& table,
                 std::int64_t id, const std::string& bytes, std::size_t size) {
  sqlite3_stmt* raw = nullptr;
  const std::string update = fmt::format("UPDATE {} SET rows = ?, data = ? WHERE image_id = ?", table);
  if (sqlite3_prepare_v2(database, update.c_str(), -1, &raw, nullptr) != SQLITE_OK) Fail(database, path);
  const Statement statement(raw, sqlite3_finalize);
  sqlite3_bind_int64(raw, 1, std::int64_t(bytes.size() / size));
  sqlite3_bind_blob64(raw, 2, bytes.data(), bytes.size(), SQLITE_STATIC);
  sqlite3_bind_int64(raw, 3, id);
  if (sqlite3_step(raw) != SQLITE_DONE) Fail(database, path);
}

}  // namespace

std::map<std::string, DatabaseImage> ReadDatabase(const std::filesystem::path& path) {
  const Connection connection = Open(path);
  sqlite3* raw = connection.get();
  std::map<std::uint32_t, std::string> names;
  std::map<std::string, DatabaseImage> images;
  Query(raw, path, "SELECT image_id, camera_id, name FROM images", [&](sqlite3_stmt* row) {
    DatabaseImage image;
    image.id = std::uint32_t(sqlite3_column_int64(row, 0));
    image.camera_id = std::uint32_t(sqlite3_column_int64(row, 1));
    const auto* name = reinterpret_cast<const char*>(sqlite3_column_text(row, 2));
    images[names[image.id] = name ? name : ""] = image;
  });
  Query(raw, path, "SELECT image_id, rows FROM keypoints", [&](sqlite3_stmt* row) {
    const auto name = names.find(std::uint32_t(sqlite3_column_int64(row, 0)));
    if (name != names.end()) images[name->second].keypoints = sqlite3_column_int(row, 1);
  });
  Query(raw, path, "SELECT pair_id, rows FROM two_view_geometries WHERE rows > 0", [&](sqlite3_stmt* row) {
    const auto [a, b] = PairOf(sqlite3_column_int64(row, 0));
    const auto first = names.find(a), second = names.find(b);
    if (first == names.end() || second == names.end()) return;
    const int matches = sqlite3_column_int(row, 1);
    images[first->second].partners[second->second] = matches;
    images[second->second].partners[first->second] = matches;
  });
  return images;
}

std::map<std::string, Descriptors> ReadDescriptors(const std::filesystem::path& path) {
  const Connection connection = Open(path);
  std::map<std::string, Descriptors> all;
  if (!HasTable(connection.get(), path, "descriptors")) return all;
  bool fits = true;
  Query(connection.get(), path,
        "SELECT images.name, rows, cols, data FROM descriptors JOIN images ON images.image_id = "
        "descriptors.image_id",
        [&](sqlite3_stmt* row) {
          const auto* name = reinterpret_cast<const char*>(sqlite3_column_text(row, 0));
          const auto rows = sqlite3_column_int64(row, 1), columns = sqlite3_column_int64(row, 2);
          const auto* bytes = static_cast<const std::uint8_t*>(sqlite3_column_blob(row, 3));
          const std::int64_t size = sqlite3_column_bytes(row, 3);
          fits = fits && name && columns == Descriptors::kSize && rows * columns == size;
          if (!fits) return;
          Descriptors descriptors{name, {}};
          if (size > 0) descriptors.values.assign(bytes, bytes + size);
          all[name] = std::move(descriptors);
        });
  return fits ? all : std::map<std::string, Descriptors>{};
}

FeaturePlaces ReadFeaturePlaces(const std::filesystem::path& path) {
  const Connection connection = Open(path);
  FeaturePlaces places;
  if (!HasColumn(connection.get(), path, "keypoints", "data")) return places;
  Query(connection.get(), path,
        "SELECT images.name, rows, cols, data FROM keypoints JOIN images ON images.image_id = "
        "keypoints.image_id",
        [&](sqlite3_stmt* row) {
          const auto* name = reinterpret_cast<const char*>(sqlite3_column_text(row, 0));
          const Blob blob = GetBlob(row, 1);
          std::vector<Eigen::Vector2f>& all = places[name ? name : ""];
          for (std::size_t i = 0; i < blob.rows; ++i)
            all.emplace_back(blob.Get<float>(i, 0), blob.Get<float>(i, 1));
        });
  return places;
}

std::vector<PictureMatches> ReadMatches(const std::filesystem::path& path, Matches which) {
  const Connection connection = Open(path);
  const char* table = which == Matches::kFound ? "matches" : "two_view_geometries";
  std::vector<PictureMatches> all;
  if (!HasColumn(connection.get(), path, table, "data")) return all;
  std::map<std::uint32_t, std::string> names;
  for (const auto& [name, image] : ReadDatabase(path)) names[image.id] = name;
  Query(
      connection.get(), path,
      fmt::format("SELECT pair_id, rows, cols, data FROM {} WHERE rows > 0 ORDER BY pair_id", table).c_str(),
      [&](sqlite3_stmt* row) {
        const auto [a, b] = PairOf(sqlite3_column_int64(row, 0));
        const Blob blob = GetBlob(row, 1);
        if (!names.contains(a) || !names.contains(b) || blob.rows == 0) return;
        PictureMatches matches{names[a], names[b], {}};
        for (std::size_t i = 0; i < blob.rows; ++i)
          matches.features.emplace_back(int(blob.Get<std::uint32_t>(i, 0)),
                                        int(blob.Get<std::uint32_t>(i, 1)));
        all.push_back(std::move(matches));
      });
  return all;
}

void DropFeatures(const std::filesystem::path& path,
                  const std::map<std::string, std::vector<bool>>& dropped) {
  const Connection connection = Open(path, SQLITE_OPEN_READWRITE);
  sqlite3* raw = connection.get();
  Execute(raw, path, "BEGIN IMMEDIATE; DELETE FROM matches; DELETE FROM two_view_geometries;");
  struct Row {
    std::int64_t id;
    std::string bytes;
    std::size_t size;
  };
  for (const char* table : {"keypoints", "descriptors"}) {
    std::vector<Row> rows;
    const std::string query = fmt::format(
        "SELECT images.name, rows, cols, data, {0}.image_id FROM {0} JOIN images ON images.image_id = "
        "{0}.image_id",
        table);
    Query(raw, path, query.c_str(), [&](sqlite3_stmt* row) {
      const auto* name = reinterpret_cast<const char*>(sqlite3_column_text(row, 0));
      const auto found = dropped.find(name ? name : "");
      const Blob blob = GetBlob(row, 1);
      if (found != dropped.end() && blob.rows > 0)
        rows.push_back({sqlite3_column_int64(row, 4), Kept(blob, found->second), blob.size});
    });
    for (const Row& row : rows) ReplaceRows(raw, path, table, row.id, row.bytes, row.size);
  }
  Execute(raw, path, "COMMIT;");
}

void NormalizeDatabase(const std::filesystem::path& path, bool single_camera) {
  const Connection connection = Open(path, SQLITE_OPEN_READWRITE);
  sqlite3* raw = connection.get();
  const auto has = [&](const std::string& table) { return HasTable(raw, path, table); };
  std::string statements;
  for (const char* table : {"matches", "two_view_geometries"})
    if (has(table)) statements += fmt::format("DELETE FROM {};", table);
  const bool numbers_known = has("cameras") && has("images") && has("keypoints") && has("descriptors") &&
                             !has("pose_priors") && !has("frames");
  if (numbers_known) {
    if (single_camera)
      statements += "UPDATE images SET camera_id = (SELECT camera_id FROM images ORDER BY name LIMIT 1);";
    statements += kOrder;
    for (const char* table : {"images", "keypoints", "descriptors"})
      statements += Renumber(table, "image_id", "image_numbers");
    for (const char* table : {"images", "cameras"})
      statements += Renumber(table, "camera_id", "camera_numbers");
  }
  Change(raw, path, statements);
}

int SetGuessedFocalLengths(const std::filesystem::path& path, double factor) {
  const Connection connection = Open(path, SQLITE_OPEN_READWRITE);
  sqlite3* raw = connection.get();
  if (!HasTable(raw, path, "cameras")) return 0;
  std::map<std::int64_t, std::vector<double>> cameras;
  Query(raw, path, "SELECT camera_id, model, width, height, params FROM cameras WHERE prior_focal_length = 0",
        [&](sqlite3_stmt* row) {
          const CameraModel* model = FindCameraModel(sqlite3_column_int(row, 1));
          const std::size_t bytes = std::size_t(sqlite3_column_bytes(row, 4));
          if (!model || bytes != std::size_t(model->parameters) * sizeof(double)) return;
          std::vector<double> parameters(std::size_t(model->parameters));
          std::memcpy(parameters.data(), sqlite3_column_blob(row, 4), bytes);
          const double focal = factor * std::max(sqlite3_column_int(row, 2), sqlite3_column_int(row, 3));
          std::fill_n(parameters.begin(), FocalLengths(model->name), focal);
          cameras[sqlite3_column_int64(row, 0)] = std::move(parameters);
        });
  for (const auto& [id, parameters] : cameras) {
    sqlite3_stmt* update = nullptr;
    if (sqlite3_prepare_v2(raw, "UPDATE cameras SET params = ? WHERE camera_id = ?", -1, &update, nullptr) !=
        SQLITE_OK)
      Fail(raw, path);
    const Statement statement(update, sqlite3_finalize);
    sqlite3_bind_blob(update, 1, parameters.data(), int(parameters.size() * sizeof(double)), SQLITE_STATIC);
    sqlite3_bind_int64(update, 2, id);
    if (sqlite3_step(update) != SQLITE_DONE) Fail(raw, path);
  }
  return int(cameras.size());
}

}  // namespace polarscan
