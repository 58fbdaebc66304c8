// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/colmap/database.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include "helpers.h"

namespace polarscan {
namespace {

// Every row of every table of COLMAP 3.8 that pictures and features are in.
std::vector<std::string> Rows(const std::filesystem::path& path) {
  sqlite3* database = nullptr;
  EXPECT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  std::vector<std::string> rows;
  for (const std::string table : {"cameras", "images", "keypoints", "descriptors", "matches"}) {
    const auto add = [](void* all, int count, char** values, char**) {
      std::string row;
      for (int i = 0; i < count; ++i) row += fmt::format("{} ", values[i] ? values[i] : "-");
      static_cast<std::vector<std::string>*>(all)->push_back(row);
      return 0;
    };
    EXPECT_EQ(
        sqlite3_exec(database, ("SELECT '" + table + "', * FROM " + table).c_str(), add, &rows, nullptr),
        SQLITE_OK);
  }
  sqlite3_close(database);
  return rows;
}

// As COLMAP 3.8 would leave them: pictures with these numbers and cameras, in this order.
struct Entry {
  int id;
  std::string name;
  int camera;
};
void Write(const std::filesystem::path& path, const std::vector<Entry>& entries,
           const std::string& more = "") {
  std::string sql =
      "CREATE TABLE cameras (camera_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, model INTEGER NOT NULL, "
      "params BLOB);"
      "CREATE TABLE images (image_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, name TEXT NOT NULL UNIQUE, "
      "camera_id "
      "INTEGER NOT NULL, CONSTRAINT image_id_check CHECK(image_id >= 0 and image_id < 2147483647), FOREIGN "
      "KEY(camera_id) "
      "REFERENCES cameras(camera_id));"
      "CREATE TABLE keypoints (image_id INTEGER PRIMARY KEY NOT NULL, data BLOB, FOREIGN KEY(image_id) "
      "REFERENCES "
      "images(image_id) ON DELETE CASCADE);"
      "CREATE TABLE descriptors (image_id INTEGER PRIMARY KEY NOT NULL, data BLOB, FOREIGN KEY(image_id) "
      "REFERENCES "
      "images(image_id) ON DELETE CASCADE);"
      "CREATE TABLE matches (pair_id INTEGER PRIMARY KEY NOT NULL, data BLOB);"
      "INSERT INTO matches VALUES (4711, 'm');" +
      more;
  std::set<int> cameras;
  for (const auto& [id, name, camera] : entries) {
    if (cameras.insert(camera).second) sql += fmt::format("INSERT INTO cameras VALUES ({}, 2, 'f');", camera);
    sql += fmt::format("INSERT INTO images VALUES ({}, '{}', {});", id, name, camera);
    for (const char* table : {"keypoints", "descriptors"})
      sql += fmt::format("INSERT INTO {} VALUES ({}, '{} of {}');", table, id, table, name);
  }
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
      << sqlite3_errmsg(database);
  sqlite3_close(database);
}

using Database = FolderTest;

TEST_F(Database, TheOrderInWhichThreadsFinishedIsForgotten) {
  Write(folder / "a.db", {{1, "a.png", 1}, {2, "b.png", 1}, {3, "c.png", 1}});
  Write(folder / "b.db", {{2, "a.png", 1}, {3, "b.png", 1}, {1, "c.png", 1}});
  EXPECT_NE(Rows(folder / "a.db"), Rows(folder / "b.db"));
  for (const char* name : {"a.db", "b.db"}) NormalizeDatabase(folder / name, true);
  EXPECT_EQ(Rows(folder / "a.db"), Rows(folder / "b.db"));
  EXPECT_EQ(Rows(folder / "a.db"),
            (std::vector<std::string>{
                "cameras 1 2 f ", "images 1 a.png 1 ", "images 2 b.png 1 ", "images 3 c.png 1 ",
                "keypoints 1 keypoints of a.png ", "keypoints 2 keypoints of b.png ",
                "keypoints 3 keypoints of c.png ", "descriptors 1 descriptors of a.png ",
                "descriptors 2 descriptors of b.png ", "descriptors 3 descriptors of c.png "}));
}

TEST_F(Database, PicturesThatWereReadAfterAKillGetTheSameCamera) {
  Write(folder / "whole.db", {{1, "a.png", 1}, {2, "b.png", 1}, {3, "c.png", 1}});
  Write(folder / "killed.db", {{1, "b.png", 1}, {2, "a.png", 2}, {3, "c.png", 2}});
  for (const char* name : {"whole.db", "killed.db"}) NormalizeDatabase(folder / name, true);
  EXPECT_EQ(Rows(folder / "whole.db"), Rows(folder / "killed.db"));
}

TEST_F(Database, CamerasOfTheirOwnAreNumberedAsTheirPictures) {
  Write(folder / "a.db", {{1, "a.png", 1}, {2, "b.png", 2}});
  Write(folder / "b.db", {{2, "a.png", 2}, {1, "b.png", 1}});
  for (const char* name : {"a.db", "b.db"}) NormalizeDatabase(folder / name, false);
  EXPECT_EQ(Rows(folder / "a.db"), Rows(folder / "b.db"));
  EXPECT_EQ(Rows(folder / "b.db")[2], "images 1 a.png 1 ");
  EXPECT_EQ(Rows(folder / "b.db")[3], "images 2 b.png 2 ");
}

TEST_F(Database, OfALaterColmapOnlyMatchesAreForgotten) {
  Write(folder / "a.db", {{2, "a.png", 1}, {1, "b.png", 1}}, "CREATE TABLE frames (frame_id INTEGER);");
  std::vector<std::string> before = Rows(folder / "a.db");
  NormalizeDatabase(folder / "a.db", true);
  before.pop_back();  // the match
  EXPECT_EQ(Rows(folder / "a.db"), before);
}

// Two pictures with three features each, in the columns of COLMAP 3.8, and a match that was not verified.
void WriteFeatures(const std::filesystem::path& path) {
  const auto blob = [](const auto& values) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(values.data());
    std::string text;
    for (std::size_t i = 0; i < values.size() * sizeof(values[0]); ++i)
      text += fmt::format("{:02x}", bytes[i]);
    return "x'" + text + "'";
  };
  std::string sql =
      "CREATE TABLE images (image_id INTEGER, name TEXT, camera_id INTEGER);"
      "INSERT INTO images VALUES (1, 'a.png', 1), (2, 'b.png', 1);";
  for (const char* table : {"keypoints", "descriptors"})
    sql += fmt::format("CREATE TABLE {} (image_id INTEGER, rows INTEGER, cols INTEGER, data BLOB);", table);
  for (const char* table : {"matches", "two_view_geometries"})
    sql += fmt::format("CREATE TABLE {} (pair_id INTEGER, rows INTEGER, cols INTEGER, data BLOB);", table);
  for (const float id : {1.f, 2.f}) {
    const std::vector<float> places = {id, 10, 7, 7, id, 20, 7, 7, id, 30, 7, 7};
    std::vector<unsigned char> descriptors(3 * 128);
    for (std::size_t i = 0; i < descriptors.size(); ++i) descriptors[i] = static_cast<unsigned char>(i / 128);
    sql += fmt::format("INSERT INTO keypoints VALUES ({}, 3, 4, {});", id, blob(places));
    sql += fmt::format("INSERT INTO descriptors VALUES ({}, 3, 128, {});", id, blob(descriptors));
  }
  sql += fmt::format("INSERT INTO matches VALUES ({}, 2, 2, {});", std::int64_t(2147483647) + 2,
                     blob(std::vector<std::uint32_t>{0, 2, 1, 0}));
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
      << sqlite3_errmsg(database);
  sqlite3_close(database);
}

TEST_F(Database, FeaturesAreReadAndDropped) {
  const std::filesystem::path path = folder / "a.db";
  WriteFeatures(path);
  ASSERT_EQ(ReadFeaturePlaces(path).at("b.png").size(), 3u);
  EXPECT_EQ(ReadFeaturePlaces(path).at("b.png")[1], Eigen::Vector2f(2, 20));
  EXPECT_TRUE(ReadMatches(path, Matches::kVerified).empty());
  const auto matches = ReadMatches(path, Matches::kFound);
  ASSERT_EQ(matches.size(), 1u);
  EXPECT_EQ(matches[0].a, "a.png");
  EXPECT_EQ(matches[0].b, "b.png");
  EXPECT_EQ(matches[0].features, (std::vector<IndexPair>{{0, 2}, {1, 0}}));

  DropFeatures(path, {{"b.png", {false, true, false}}});
  EXPECT_EQ(ReadFeaturePlaces(path).at("a.png").size(), 3u);
  EXPECT_EQ(ReadFeaturePlaces(path).at("b.png"), (std::vector<Eigen::Vector2f>{{2, 10}, {2, 30}}));
  const Descriptors left = ReadDescriptors(path).at("b.png");
  ASSERT_EQ(left.count(), 2);
  EXPECT_EQ(left.values.back(), 2) << "the third's";
  EXPECT_TRUE(ReadMatches(path, Matches::kFound).empty());
  DropFeatures(path, {{"b.png", {true, true}}});
  EXPECT_TRUE(ReadFeaturePlaces(path).at("b.png").empty());
  EXPECT_EQ(ReadDatabase(path).at("b.png").keypoints, 0);
}

TEST_F(Database, ADamagedOneIsNamed) {
  WriteFileAtomically(folder / "a.db", "no database, but long enough to be looked at as if it were one");
  const std::string message = ErrorOf([&] { NormalizeDatabase(folder / "a.db", true); });
  EXPECT_NE(message.find(folder / "a.db"), std::string::npos) << message;
}

}  // namespace
}  // namespace polarscan
