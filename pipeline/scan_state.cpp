// SPDX-License-Identifier: Apache-2.0
#include "pipeline/scan_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "core/files/files.h"

namespace polarscan {
namespace {

using nlohmann::json;
using Type = json::value_t;

constexpr std::pair<StageStatus, const char*> kStatusNames[] = {
    {StageStatus::kRunning, "running"}, {StageStatus::kDone, "done"}, {StageStatus::kFailed, "failed"}};

// Whether what is there under these names is of this type.
bool Holds(const json& record, std::initializer_list<const char*> names, Type type) {
  return std::ranges::all_of(
      names, [&](const char* name) { return !record.contains(name) || record[name].type() == type; });
}

bool AllOf(const json& values, Type type) {
  return std::ranges::all_of(values, [&](const json& value) { return value.type() == type; });
}

bool IsRecord(const json& record) {
  return record.is_object() &&
         Holds(record, {"state", "version", "inputs", "outputs", "error"}, Type::string) &&
         Holds(record, {"before", "counts"}, Type::object) && Holds(record, {"warnings"}, Type::array) &&
         AllOf(record.value("before", json::object()), Type::string) &&
         AllOf(record.value("warnings", json::array()), Type::string);
}

bool IsState(const json& state) {
  return state.is_object() && Holds(state, {"version", "input", "input_from_here"}, Type::string) &&
         Holds(state, {"stages", "options", "views", "cloud"}, Type::object) &&
         std::ranges::all_of(state.value("stages", json::object()), IsRecord);
}

// What is none of the known ones counts as failed.
StageStatus StatusOf(const std::string& name) {
  const auto* const found =
      std::ranges::find(kStatusNames, name, [](const auto& pair) { return std::string(pair.second); });
  if (found != std::end(kStatusNames)) return found->first;
  return name.empty() ? StageStatus::kNone : StageStatus::kFailed;
}

StageRecord RecordFrom(const json& value) {
  StageRecord record;
  record.status = StatusOf(value.value("state", ""));
  record.version = value.value("version", "");
  record.inputs = value.value("inputs", "");
  record.before = value.value("before", json::object()).get<std::map<std::string, std::string>>();
  record.outputs = value.value("outputs", "");
  record.error = value.value("error", "");
  record.counts = value.value("counts", json());
  record.warnings = value.value("warnings", json::array()).get<std::vector<std::string>>();
  const json seconds = value.value("seconds", json());
  record.seconds = seconds.is_number() ? seconds.get<double>() : 0;
  return record;
}

json WarningsOf(const ScanState& state) {
  json all = json::array();
  for (const std::string& stage : StageNames())
    for (const std::string& warning : state.Stage(stage).warnings) all.push_back(warning);
  return all;
}

}  // namespace

const std::vector<std::string>& StageNames() {
  static const std::vector<std::string> names = {"views",  "sfm",  "dense", "stereo",
                                                 "fusion", "mesh", "report"};
  return names;
}

json ToJson(const StageRecord& record) {
  json value = {{"version", record.version}, {"inputs", record.inputs}, {"before", record.before}};
  for (const auto& [status, name] : kStatusNames)
    if (record.status == status) value["state"] = name;
  if (!record.outputs.empty()) value["outputs"] = record.outputs;
  if (!record.error.empty()) value["error"] = record.error;
  if (!record.counts.is_null()) value["counts"] = record.counts;
  if (record.status == StageStatus::kRunning) return value;
  value["seconds"] = record.seconds;
  value["warnings"] = record.warnings;
  return value;
}

StageRecord ScanState::Stage(const std::string& name) const {
  const auto found = stages.find(name);
  return found == stages.end() ? StageRecord() : found->second;
}

json ScanState::OptionsOf(const std::string& stage) const {
  const json own = options.value(stage, json());
  return own.is_object() ? own : json::object();
}

ScanState ReadScanState(const std::filesystem::path& scan_json) {
  const json value = ReadJson(scan_json);
  if (!IsState(value)) throw Error("this is not what a scan.json holds", scan_json.string());
  ScanState state{value.value("version", ""),
                  value.value("input", ""),
                  value.value("input_from_here", ""),
                  {},
                  value.value("options", json::object()),
                  value};
  const json stages = value.value("stages", json::object());
  for (const auto& [name, record] : stages.items()) state.stages[name] = RecordFrom(record);
  for (const char* key :
       {"version", "input", "input_from_here", "stages", "options", "options_hash", "warnings"})
    state.summary.erase(key);
  return state;
}

json ToJson(const ScanState& state) {
  json value = state.summary;
  value["version"] = state.version, value["input"] = state.input;
  value["input_from_here"] = state.input_from_here;
  value["warnings"] = WarningsOf(state);
  for (const auto& [name, record] : state.stages) value["stages"][name] = ToJson(record);
  if (state.options.empty()) return value;
  value["options"] = state.options;
  value["options_hash"] = ToHex(Hash(ToText(state.options)));
  return value;
}

std::string ResultOf(const ScanState& state, const std::string& name) {
  const StageRecord record = state.Stage(name);
  return record.status == StageStatus::kDone ? record.outputs : "";
}

bool IsOutOfDate(const ScanState& state, const std::string& stage, const std::string& earlier) {
  const StageRecord record = state.Stage(stage);
  if (record.status == StageStatus::kRunning || record.status == StageStatus::kFailed) return true;
  const auto before = record.before.find(earlier);
  return before != record.before.end() && before->second != state.Stage(earlier).outputs;
}

std::vector<PlannedStage> OutOfDateStages(const ScanState& state) {
  std::vector<PlannedStage> stages;
  const std::vector<std::string>& names = StageNames();
  for (auto stage = names.begin(); stage != names.end(); ++stage) {
    const StageRecord record = state.Stage(*stage);
    const auto earlier = std::find_if(
        names.begin(), stage, [&](const std::string& name) { return IsOutOfDate(state, *stage, name); });
    if (record.status == StageStatus::kRunning)
      stages.push_back({*stage, false, "it was stopped on the way"});
    else if (record.status == StageStatus::kFailed)
      stages.push_back({*stage, false, "it failed: " + record.error});
    else if (earlier != stage)
      stages.push_back({*stage, false, fmt::format("it is of an earlier result of stage {}", *earlier)});
  }
  return stages;
}

std::string CountsText(const nlohmann::json& counts) {
  struct Words {
    const char *key, *one, *many;
    bool even_zero = false;
  };
  static constexpr Words kWords[] = {
      {"registered", "view placed", "views placed", true},
      {"views", "view", "views", true},
      {"points", "point", "points", true},
      {"vertices", "vertex", "vertices", true},
      {"faces", "triangle", "triangles", true},
      {"damaged", "view left out, its maps are damaged", "views left out, their maps are damaged"},
      {"holes_filled", "hole filled", "holes filled"},
      {"holes_open", "hole left open", "holes left open"},
      {"pieces_dropped", "small piece left out", "small pieces left out"}};
  std::string text;
  for (const Words& words : kWords) {
    const nlohmann::json count = counts.value(words.key, nlohmann::json());
    if (!count.is_number_integer() || (count == 0 && !words.even_zero)) continue;
    text +=
        fmt::format("{}{} {}", text.empty() ? "" : ", ", ToText(count), count == 1 ? words.one : words.many);
  }
  return text.empty() ? "done" : text;
}

std::string ChangedOption(const nlohmann::json& before, const nlohmann::json& now,
                          const std::string& prefix) {
  for (const auto& [name, value] : now.items()) {
    const nlohmann::json old = before.is_object() ? before.value(name, nlohmann::json()) : nlohmann::json();
    if (old == value) continue;
    if (value.is_object()) return ChangedOption(old, value, name + " ");
    return fmt::format("{}{}: {} -> {}", prefix, name, ToText(old), ToText(value));
  }
  return "other options";
}

}  // namespace polarscan
