// SPDX-License-Identifier: Apache-2.0
#include "pipeline/pipeline_scan.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/files/files.h"
#include "core/mesh.h"
#include "toy_scan.h"

namespace polarscan::test {
namespace fs = std::filesystem;

Outcome Simulate(const fs::path& mesh, const fs::path& folder, const std::string& rings, int width,
                 int height) {
  WriteMesh(mesh, Ball());
  return RunPolarscan({"simulate", "-o", folder.string(), "--mesh", mesh.string(), "--no-table", "--texture",
                       "strong", "--samples", "1", "--masks", "--known-poses", "--rings", rings, "--width",
                       std::to_string(width), "--height", std::to_string(height)});
}

std::unique_ptr<TemporaryFolder> Pipeline::suite_;

void Pipeline::SetUpTestSuite() {
  suite_ = std::make_unique<TemporaryFolder>();
  const Outcome outcome = Simulate(*suite_ / "ball.ply", Input(), "30:8", 64, 56);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
}

std::vector<std::string> Pipeline::Command(const fs::path& scan, const std::vector<std::string>& more,
                                           const fs::path& input) {
  std::vector<std::string> arguments = {"reconstruct", input.string(), "-o", scan.string(), "--no-filter"};
  for (const auto& [name, value] : std::map<std::string, std::string>{{"photometric-iterations", "1"},
                                                                      {"geometric-iterations", "1"},
                                                                      {"window-radius", "2"},
                                                                      {"samples", "4"},
                                                                      {"sources", "4"},
                                                                      {"fusion-min-views", "2"}}) {
    if (std::find(more.begin(), more.end(), "--" + name) == more.end())
      arguments.insert(arguments.end(), {"--" + name, value});
  }
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

std::map<std::string, std::string> Results(const fs::path& scan) {
  std::map<std::string, std::string> results = Contents(scan / "dense/stereo/depth_maps");
  results.merge(Contents(scan / "dense/stereo/normal_maps"));
  results["cloud.ply"] = ReadFile(scan / "cloud.ply");
  return results;
}

void ExpectSameResults(const fs::path& a, const fs::path& b) {
  const auto results_a = Results(a), results_b = Results(b);
  ASSERT_EQ(results_a.size(), results_b.size());
  for (const auto& [name, bytes] : results_a) {
    ASSERT_TRUE(results_b.contains(name)) << name;
    EXPECT_TRUE(results_b.at(name) == bytes) << name << " differs";
  }
}

std::map<std::string, std::string> Plan(std::vector<std::string> command) {
  command.insert(command.end(), {"--dry-run", "--json"});
  const Outcome outcome = RunPolarscan(command);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  std::map<std::string, std::string> plan;
  const nlohmann::json printed = nlohmann::json::parse(outcome.out);
  for (const nlohmann::json& stage : printed.at("plan")) {
    EXPECT_EQ(stage.at("done"), stage.at("why") == "");
    plan[stage.at("stage")] = stage.at("why");
  }
  return plan;
}

std::map<std::string, std::string> AllDone() {
  return {{"views", ""},  {"sfm", ""},  {"dense", ""}, {"stereo", ""},
          {"fusion", ""}, {"mesh", ""}, {"report", ""}};
}

}  // namespace polarscan::test
