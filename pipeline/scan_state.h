// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace polarscan {

// "views", "sfm", "dense", "stereo", "fusion", "mesh", "report": the order in which they run.
const std::vector<std::string>& StageNames();

enum class StageStatus { kNone, kRunning, kDone, kFailed };

// What scan.json holds of a stage. running: it was begun, and ended neither well nor badly.
struct StageRecord {
  StageStatus status = StageStatus::kNone;
  std::string version, inputs;  // the program's; what stands for the content of what else it reads
  std::map<std::string, std::string> before;  // the digests that the stages before it had
  std::string outputs;                        // digest of its files; "": it left none
  std::string error;                          // of a failed one
  nlohmann::json counts;                      // what it returned; null if it did not
  std::vector<std::string> warnings;
  double seconds = 0;

  bool operator==(const StageRecord&) const = default;
};
nlohmann::json ToJson(const StageRecord& record);

// scan.json.
struct ScanState {
  std::string version, input, input_from_here;  // input: its folder; and as seen from the scan's
  std::map<std::string, StageRecord> stages;
  nlohmann::json options = nlohmann::json::object();  // of each stage, by its name
  nlohmann::json summary = nlohmann::json::object();  // all else: "views", "cloud", "offset"

  StageRecord Stage(const std::string& name) const;  // of status kNone if there is none
  // An empty object if there are none.
  nlohmann::json OptionsOf(const std::string& stage) const;
};

// Throws Error if it is damaged or holds something else.
ScanState ReadScanState(const std::filesystem::path& scan_json);
nlohmann::json ToJson(const ScanState& state);

// What stage `name` left, by its files' checksums; "" if it is not done.
std::string ResultOf(const ScanState& state, const std::string& name);

// Whether the files of `stage` were made from another result of `earlier` than there is now, or the stage did
// not end since; false where nothing is known.
bool IsOutOfDate(const ScanState& state, const std::string& stage, const std::string& earlier);

// A stage of a plan. why: for a stage to be made, "fusion-reprojection: 0.8 -> 0.6", "cloud.ply is missing".
struct PlannedStage {
  std::string name;
  bool done = false;
  std::string why;
};

// Stages whose files are not those that the stages before them would get now, in their order, with the reason
// in words; none where nothing is known.
std::vector<PlannedStage> OutOfDateStages(const ScanState& state);

// What a stage counted, for people: "12 views placed, 3041 points". Where nothing was lost, closed or cut,
// that is not said; what is not named here is for programs that read scan.json.
std::string CountsText(const nlohmann::json& counts);

// "sigma-color: 0.2 -> 0.3", the first option that differs.
std::string ChangedOption(const nlohmann::json& before, const nlohmann::json& now,
                          const std::string& prefix = "");

}  // namespace polarscan
