// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "stereo/sfm/colmap/feature_matching.h"

namespace polarscan {

// What COLMAP's database says about one picture.
struct DatabaseImage {
  std::uint32_t id = 0, camera_id = 0;
  int keypoints = 0;
  std::map<std::string, int> partners{};  // geometrically verified matches with other pictures
};

// The pictures in COLMAP's SQLite database by name (3.8 to 4.x; read only). Throws Error if it is missing or
// damaged.
std::map<std::string, DatabaseImage> ReadDatabase(const std::filesystem::path& path);

// The descriptors of all pictures, by name; empty if the database holds none, or none of SIFT's size.
std::map<std::string, Descriptors> ReadDescriptors(const std::filesystem::path& path);

// Where the features of all pictures are, by name: pixels, centres at + 0.5. Empty if the database does not
// hold them the way 3.8 to 4.x do; so are the matches then.
using FeaturePlaces = std::map<std::string, std::vector<Eigen::Vector2f>>;
FeaturePlaces ReadFeaturePlaces(const std::filesystem::path& path);

// Matches of two pictures: indices of their features.
struct PictureMatches {
  std::string a, b;
  std::vector<IndexPair> features;
};
// kFound: as they were found; kVerified: those of them that one motion of the camera explains.
enum class Matches { kFound, kVerified };
std::vector<PictureMatches> ReadMatches(const std::filesystem::path& path, Matches which);

// Takes features, by the pictures' names and true for each that goes, and all matches out of the database.
void DropFeatures(const std::filesystem::path& path, const std::map<std::string, std::vector<bool>>& dropped);

// Forgets matches and numbers the pictures in the order of their names, cameras in the order of theirs:
// COLMAP numbers them as its threads finish, and what it makes of them depends on the numbers. So the same
// pictures give the same database, whatever a program did to it before it was killed. single_camera: all
// pictures get the first one's (an extraction that goes on after a kill begins another). A database with
// other tables than those of 3.8 keeps its numbers and cameras.
void NormalizeDatabase(const std::filesystem::path& path, bool single_camera);

// Gives the cameras whose focal length COLMAP has only guessed (no EXIF) another one to start from: `factor`
// times the larger side of the picture. Returns how many there are; 0 too if the database does not hold
// cameras the way 3.8 to 4.x do.
int SetGuessedFocalLengths(const std::filesystem::path& path, double factor);

}  // namespace polarscan
