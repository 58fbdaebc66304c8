// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "program.h"

namespace polarscan::test {

// Pictures of a textured ball with masks and poses. The ball has radius 1; it is written to `mesh`.
Outcome Simulate(const std::filesystem::path& mesh, const std::filesystem::path& folder,
                 const std::string& rings, int width, int height);

// Few and tiny pictures: what comes out is coarse, and each test takes seconds. Options are chosen for speed,
// not for quality; the bounds are those of a coarse but right reconstruction.
class Pipeline : public testing::Test {
 protected:
  static void SetUpTestSuite();
  static void TearDownTestSuite() { suite_.reset(); }

  static std::filesystem::path Input() { return *suite_ / "input"; }
  std::filesystem::path Folder(const std::string& name) const { return folder_ / name; }

  // `polarscan reconstruct` with quick options, each of which `more` may set otherwise.
  static std::vector<std::string> Command(const std::filesystem::path& scan,
                                          const std::vector<std::string>& more = {},
                                          const std::filesystem::path& input = Input());

  static std::unique_ptr<TemporaryFolder> suite_;
  TemporaryFolder folder_;
};

// What must be the same bytes for the same seed: maps and cloud.
std::map<std::string, std::string> Results(const std::filesystem::path& scan);
void ExpectSameResults(const std::filesystem::path& a, const std::filesystem::path& b);

// What a dry run says of each stage: "" if it is done, else why it would be made.
std::map<std::string, std::string> Plan(std::vector<std::string> command);
// The plan of a scan where all is done.
std::map<std::string, std::string> AllDone();

}  // namespace polarscan::test
