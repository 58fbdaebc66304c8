// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "helpers.h"

namespace polarscan {

// The model with a point at the origin that all images see, if it has none: COLMAP's own never have none.
SparseModel WithPoint(SparseModel model);

// A `colmap` made of shell, in a folder of its own, that does what a test wants of each command. Calls are
// logged.
class FakeColmap {
 public:
  // `release`: "3.8" or "4.0", whose names of options it knows.
  FakeColmap(const std::filesystem::path& folder, const std::string& release);

  std::string program() const { return folder_ / "colmap"; }
  std::string calls() const {
    return std::filesystem::exists(folder_ / "calls") ? ReadFile(folder_ / "calls") : "";
  }
  // What a command does: lines of shell; $database and $output are set.
  void On(const std::string& command, const std::string& script) {
    WriteFileAtomically(folder_ / (command + ".sh"), script + "\n");
  }
  // feature_extractor leaves a database with these pictures; the matchers then match the first `matched` of
  // them with their neighbours.
  void ExtractorWrites(const std::vector<std::string>& names, int keypoints, int matched);
  // From now on matched pictures have so many verified matches instead of 50.
  void Matches(int count) { matches_ = count; }
  // Its help lists this option, too.
  void ListsOption(const std::string& name);
  // From now on pictures have 20 random descriptors each, and matches can be imported.
  void ImportsMatches();
  // The extractor's database also holds one camera of this size: SIMPLE_RADIAL, focal length a guess.
  void ExtractorGuessesFocalLength(int width, int height);
  // mapper leaves these models, WithPoint, in 0, 1, ...
  void MapperWrites(const std::vector<SparseModel>& models);

 private:
  void Change(const std::string& database, const std::string& sql);

  std::filesystem::path folder_;
  std::string descriptor_tables_, descriptors_;
  int matches_ = 50;
};

}  // namespace polarscan
