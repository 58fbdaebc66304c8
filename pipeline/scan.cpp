// SPDX-License-Identifier: Apache-2.0
#include "pipeline/scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/error.h"
#include "core/files.h"
#include "core/temporaries.h"
#include "core/words.h"

namespace polarscan {
namespace fs = std::filesystem;
using nlohmann::literals::operator""_json_pointer;
namespace {

constexpr const char* kFile = "scan.json";

struct StageFiles {
  std::string stage;
  std::vector<fs::path> outputs;  // relative to the scan folder; the first one is always there, others may be
};

const std::vector<StageFiles>& AllStageFiles() {
  static const std::vector<StageFiles> all = {
      {"views", {"views"}},
      {"sfm", {"sfm/model"}},
      {"dense",
       {"dense/views.json", "dense/images", "dense/polar", "dense/masks", "dense/sparse",
        "dense/stereo/patch-match.cfg", "dense/stereo/fusion.cfg"}},
      {"stereo", {"dense/stereo/depth_maps", "dense/stereo/normal_maps"}},
      {"fusion", {"cloud.ply", "offset.txt"}},
      {"mesh", {"mesh.ply"}},
      {"report", {"report.html"}}};
  return all;
}

const std::vector<fs::path>& OutputsOf(const std::string& stage) {
  return std::ranges::find(AllStageFiles(), stage, &StageFiles::stage)->outputs;
}

// What killed programs left where this stage writes.
void RemoveTemporariesOf(const fs::path& folder, const std::string& stage) {
  for (const fs::path& output : OutputsOf(stage)) {
    RemoveTemporaries((folder / output).parent_path(), Below::kNo);
    RemoveTemporaries(folder / output, Below::kYes);
  }
}

double SecondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// What scan.json holds of a stage; an empty object if nothing.
nlohmann::json StageRecord(const nlohmann::json& state, const std::string& stage) {
  return state.value("stages", nlohmann::json::object()).value(stage, nlohmann::json::object());
}

using Type = nlohmann::json::value_t;

// Whether what is there under these names is of this type.
bool Holds(const nlohmann::json& record, std::initializer_list<const char*> names, Type type) {
  return std::ranges::all_of(
      names, [&](const char* name) { return !record.contains(name) || record[name].type() == type; });
}

bool AllOf(const nlohmann::json& values, Type type) {
  return std::ranges::all_of(values, [&](const nlohmann::json& value) { return value.type() == type; });
}

bool IsRecord(const nlohmann::json& record) {
  return record.is_object() &&
         Holds(record, {"state", "version", "inputs", "outputs", "error"}, Type::string) &&
         Holds(record, {"before", "counts"}, Type::object) && Holds(record, {"warnings"}, Type::array) &&
         AllOf(record.value("before", nlohmann::json::object()), Type::string) &&
         AllOf(record.value("warnings", nlohmann::json::array()), Type::string);
}

// scan.json, of the types that the rest of this file takes for granted.
nlohmann::json ReadStateFile(const fs::path& path) {
  nlohmann::json state = ReadJson(path);
  if (!state.is_object() || !Holds(state, {"input", "input_from_here"}, Type::string) ||
      !Holds(state, {"stages", "options", "views", "cloud"}, Type::object) ||
      !std::ranges::all_of(state.value("stages", nlohmann::json::object()), IsRecord))
    throw Error("this is not what a scan.json holds", path.string());
  return state;
}

nlohmann::json AllWarnings(const nlohmann::json& state) {
  nlohmann::json all = nlohmann::json::array();
  for (const std::string& stage : StageNames()) {
    const nlohmann::json warnings = StageRecord(state, stage).value("warnings", nlohmann::json::array());
    all.insert(all.end(), warnings.begin(), warnings.end());
  }
  return all;
}

// What a stage counted, for people: "12 views placed, 3041 points". Where nothing was lost, closed or cut,
// that is not said; what is not named here is for programs that read scan.json.
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
      {"gaps_closed", "gap closed", "gaps closed"},
      {"gaps_cut", "gap left open", "gaps left open"},
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

// "sigma-color: 0.2 -> 0.3", the first one that differs.
std::string ChangedOption(const nlohmann::json& before, const nlohmann::json& now,
                          const std::string& prefix = "") {
  for (const auto& [name, value] : now.items()) {
    const nlohmann::json old = before.is_object() ? before.value(name, nlohmann::json()) : nlohmann::json();
    if (old == value) continue;
    if (value.is_object()) return ChangedOption(old, value, name + " ");
    return fmt::format("{}{}: {} -> {}", prefix, name, ToText(old), ToText(value));
  }
  return "other options";
}

}  // namespace

const std::vector<std::string>& StageNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const StageFiles& files : AllStageFiles()) all.push_back(files.stage);
    return all;
  }();
  return names;
}

Scan::Scan(const fs::path& folder, Progress& progress, Mode mode)
    : folder_(folder),
      progress_(&progress),
      mode_(mode),
      checksums_(folder),
      lock_(mode == Mode::kWork ? LockFolder(folder, "scan") : Descriptor(-1)) {}

// A damaged scan.json costs no result: what the stages left is found out again.
void Scan::ReadState() {
  const fs::path path = folder_ / kFile;
  if (!fs::exists(path)) return;
  try {
    state_ = ReadStateFile(path);
  } catch (const Error& problem) {
    state_ = nlohmann::json::object();
    if (mode_ == Mode::kWork) fs::rename(path, folder_ / "scan.json.damaged");
    progress_->Warn(
        fmt::format("{}; kept as scan.json.damaged, each stage is looked at again", problem.what()));
  }
}

// Where the input lies as seen from the scan: the same after both were moved together.
std::string Scan::InputFromHere(const std::string& input) const {
  return fs::path(input).lexically_relative(fs::weakly_canonical(folder_)).string();
}

void Scan::CheckInput(const std::string& input) const {
  const std::string before = state_.value("input", input);
  const bool came_along =
      state_.value("input_from_here", "") == InputFromHere(input);  // both moved, or copied
  if (before != input && !came_along)
    throw Error(fmt::format("this is a scan of another input ({})", before), folder_.string(),
                "Choose another folder with -o");
}

namespace {

void RequireScanOrNothing(const fs::path& folder) {
  if (folder.empty())
    throw Error("the folder for the scan has no name", "-o \"\"", "Choose a new folder with -o");
  const bool is_scan = fs::exists(folder / kFile) || fs::exists(folder / "scan.json.damaged");
  if (is_scan || !fs::is_directory(folder)) return;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (!IsHidden(entry.path()))
      throw Error("this folder holds other files and no scan", folder.string(),
                  "Choose a new folder with -o");
}

}  // namespace

Scan Scan::OpenOrCreate(const fs::path& folder, const fs::path& input, std::uint64_t fingerprint,
                        Progress& progress) {
  RequireScanOrNothing(folder);
  CreateFolder(folder);
  Scan scan(folder, progress);
  scan.ReadState();
  const std::string input_name = fs::weakly_canonical(input).string();
  scan.CheckInput(input_name);
  scan.state_["input"] = input_name;
  scan.state_["input_from_here"] = scan.InputFromHere(input_name);
  scan.state_["version"] = POLARSCAN_VERSION;
  scan.input_ = ToHex(fingerprint);
  scan.Save();
  return scan;
}

Scan Scan::Plan(const fs::path& folder, const fs::path& input, std::uint64_t fingerprint,
                Progress& progress) {
  RequireScanOrNothing(folder);
  Scan scan(folder, progress, Mode::kPlan);
  scan.ReadState();
  scan.CheckInput(fs::weakly_canonical(input).string());
  scan.input_ = ToHex(fingerprint);
  return scan;
}

Scan Scan::Open(const fs::path& folder, Progress& progress) { return OpenAs(Mode::kWork, folder, progress); }

Scan Scan::OpenToRead(const fs::path& folder, Progress& progress) {
  return OpenAs(Mode::kPlan, folder, progress);
}

Scan Scan::OpenAs(Mode mode, const fs::path& folder, Progress& progress) {
  if (!fs::exists(folder / kFile))
    throw Error("this folder holds no scan (no scan.json)", folder.string(),
                "Make one: polarscan reconstruct INPUT -o SCAN");
  Scan scan(folder, progress, mode);
  scan.state_ = ReadStateFile(folder / kFile);
  return scan;
}

// Empty if it is done.
std::string Scan::WhyNotDone(const Stage& stage) const {
  const nlohmann::json record = StageRecord(state_, stage.name);
  const std::string how = record.value("state", "");
  if (how.empty()) return "it was not made yet";
  if (how == "running") return "it was stopped on the way";
  if (how != "done") return "it failed: " + record.value("error", "");
  if (record.value("version", "") != POLARSCAN_VERSION) return "another version of polarscan made it";
  const nlohmann::json options = state_.value("options", nlohmann::json::object());
  if (options.value(stage.name, nlohmann::json()) != stage.options)
    return ChangedOption(options.value(stage.name, nlohmann::json()), stage.options);
  const nlohmann::json before = record.value("before", nlohmann::json::object());
  for (const auto& [name, digest] : before_.items())
    if (before.value(name, nlohmann::json()) != digest)
      return fmt::format("stage {} has another result now", name);
  if (record.value("inputs", "") != stage.inputs) return "what it is made from has changed";
  if (const nlohmann::json damaged = record.value("/counts/damaged"_json_pointer, nlohmann::json(0));
      damaged != 0)
    return fmt::format("{} damaged views were left out", ToText(damaged));
  const FileSums found = checksums_.Measure(OutputsOf(stage.name));
  if (Digest(found) == record.value("outputs", "")) return "";
  const std::string difference = Difference(checksums_.Recorded(stage.name), found);
  return difference.empty() ? "its files were changed" : difference;
}

// The files of a stage, which is done, are input of the ones after it.
void Scan::Follow(const std::string& stage) {
  before_[stage] = StageRecord(state_, stage).value("outputs", "");
}

void Scan::AddToPlan(const Stage& stage) {
  std::string why = WhyNotDone(stage);
  const auto remade = std::ranges::find(plan_, false, &PlannedStage::done);
  if (why.empty() && remade != plan_.end())
    why = fmt::format("unless stage {} comes out the same again", remade->name);
  const bool done = why.empty();
  plan_.push_back({stage.name, done, why});
  progress_->Info(done ? fmt::format("{:<8} done before", stage.name)
                       : fmt::format("{:<8} to be made: {}", stage.name, why));
  if (done) Follow(stage.name);  // what a stage to be made will leave, nobody knows
}

void Scan::Run(const Stage& stage, const Work& work) {
  progress_->Check();
  if (mode_ == Mode::kPlan) return AddToPlan(stage);
  if (const std::string why = WhyNotDone(stage); why.empty()) {
    progress_->Info(fmt::format("{:<8} done before", stage.name));
  } else {
    if (!StageRecord(state_, stage.name).empty())
      progress_->Info(fmt::format("{:<8} again: {}", stage.name, why));
    Make(stage, work);
  }
  Follow(stage.name);
}

void Scan::Make(const Stage& stage, const Work& work) {
  progress_->TakeWarnings();
  const nlohmann::json options_before =
      state_.value("options", nlohmann::json::object()).value(stage.name, nlohmann::json());
  state_["options"][stage.name] = stage.options;
  state_["options_hash"] = ToHex(Hash(ToText(state_["options"])));
  nlohmann::json& record = state_["stages"][stage.name];
  const nlohmann::json record_before = record;
  record = {
      {"state", "running"}, {"version", POLARSCAN_VERSION}, {"inputs", stage.inputs}, {"before", before_}};
  RemoveTemporariesOf(folder_, stage.name);
  Save();

  const auto begin = std::chrono::steady_clock::now();
  const auto finish = [&](const char* state) {
    progress_->End();
    record["state"] = state;
    record["seconds"] = SecondsSince(begin);
    record["warnings"] = progress_->TakeWarnings();
    Save();
  };
  try {
    record["counts"] = work(*progress_);
    const FileSums made = checksums_.Measure(OutputsOf(stage.name));
    if (FilesBelow(folder_ / OutputsOf(stage.name).front()).empty())
      throw Error("this stage left no result", (folder_ / OutputsOf(stage.name).front()).string());
    checksums_.Record(stage.name, made);
    record["outputs"] = Digest(made);
    finish("done");
  } catch (const Cancelled&) {
    throw;  // it stays "running": the next run goes on with it
  } catch (const std::exception& error) {
    record["error"] = error.what();
    try {
      const bool intact =
          record_before.is_object() && record_before.value("state", "") == "done" &&
          Digest(checksums_.Measure(OutputsOf(stage.name))) == record_before.value("outputs", "");
      if (intact) {  // what was done before is there: the wrong option is forgotten
        record = record_before;
        state_["options"][stage.name] = options_before;
        state_["options_hash"] = ToHex(Hash(ToText(state_["options"])));
        Save();
      } else {
        finish("failed");
      }
    } catch (
        const Error&) {  // the disk that failed the stage fails scan.json too: the first error says it all
    }
    throw;
  }
  progress_->Info(fmt::format("{:<8} {} ({})", stage.name, CountsText(record["counts"]),
                              FormatDuration(record["seconds"].get<double>())));
}

void Scan::ContinueAfter(const std::string& last) {
  for (const std::string& name : StageNames()) {
    const nlohmann::json record = StageRecord(state_, name);
    if (record.value("state", "") != "done")
      throw Error(fmt::format("stage '{}' of this scan is not done", name), folder_.string(),
                  "Run polarscan reconstruct first; it goes on where it stopped");
    const nlohmann::json before = record.value("before", nlohmann::json::object());
    for (const auto& [earlier, digest] : before.items())
      if (before_.value(earlier, digest) != digest)
        throw Error(
            fmt::format("stage '{}' of this scan was made from another result of stage '{}'", name, earlier),
            folder_.string(), "Run polarscan reconstruct again, or the stages in their order");
    const FileSums found = checksums_.Measure(OutputsOf(name));
    before_[name] = Digest(found);  // a file changed by hand counts as it is
    if (record.contains("outputs") && before_[name] != record["outputs"])
      progress_->Warn(fmt::format("stage {} is taken as it is, though {}", name,
                                  Difference(checksums_.Recorded(name), found)));
    if (name == last) return;
  }
}

void Scan::RecordAgain(const std::string& stage) {
  if (StageRecord(state_, stage).value("state", "") != "done") return;
  const FileSums made = checksums_.Measure(OutputsOf(stage));
  checksums_.Record(stage, made);
  state_["stages"][stage]["outputs"] = Digest(made);
  Save();
}

std::vector<ScanFinding> Scan::Check() const {
  std::vector<ScanFinding> findings;
  const bool any = state_.contains("stages");
  for (const std::string& stage : StageNames()) {
    if (!any && !FilesBelow(folder_ / OutputsOf(stage).front()).empty())
      findings.push_back({stage, "", "its files are there, but scan.json knows of no stage"});
    const nlohmann::json record = StageRecord(state_, stage);
    if (record.value("state", "") != "done") continue;
    const FileSums& recorded = checksums_.Recorded(stage);
    progress_->Begin("checking the files of " + stage, recorded.size(), "file");
    const FileSums found = checksums_.Measure(OutputsOf(stage), true, *progress_);
    const std::size_t before = findings.size();
    const std::string digest = record.value("outputs", "");
    if (!recorded.empty())  // without, nothing is known of single files
      for (const FileDifference& d : Differences(recorded, found))
        findings.push_back({stage, d.file, d.file + " " + d.what});
    if (findings.size() == before && Digest(found) != digest)
      findings.push_back(
          {stage, "",
           digest.empty() ? "it was made without checksums" : "its checksums are lost or damaged"});
  }
  return findings;
}

std::vector<ScanFinding> Scan::Repair() {
  std::vector<ScanFinding> findings = Check();
  for (ScanFinding& finding : findings) {
    if (finding.file.empty() || !fs::exists(folder_ / finding.file)) continue;
    finding.moved_to = (fs::path("damaged") / finding.file).string();
    CreateFolder((folder_ / finding.moved_to).parent_path());
    fs::rename(folder_ / finding.file, folder_ / finding.moved_to);
  }
  return findings;
}

void Scan::Note(const std::string& group, const std::string& key, const nlohmann::json& value) {
  state_[group][key] = value;
}

void Scan::Note(const std::string& key, const nlohmann::json& value) {
  if (value.is_null())
    state_.erase(key);
  else
    state_[key] = value;
}

nlohmann::json Scan::Counts(const std::string& stage) const {
  return StageRecord(state_, stage).value("counts", nlohmann::json::object());
}

void Scan::Save() {
  state_["warnings"] = AllWarnings(state_);
  WriteJson(folder_ / kFile, state_);
}

bool IsOutOfDate(const nlohmann::json& state, const std::string& stage, const std::string& earlier) {
  const nlohmann::json record = StageRecord(state, stage);
  if (record.empty()) return false;
  if (record.value("state", "done") != "done") return true;
  const nlohmann::json before = record.value("before", nlohmann::json::object());
  return before.contains(earlier) &&
         before[earlier] != StageRecord(state, earlier).value("outputs", nlohmann::json());
}

std::vector<PlannedStage> OutOfDateStages(const nlohmann::json& state) {
  std::vector<PlannedStage> stages;
  const std::vector<std::string>& names = StageNames();
  for (auto stage = names.begin(); stage != names.end(); ++stage) {
    const nlohmann::json record = StageRecord(state, *stage);
    const std::string how = record.value("state", "done");
    if (how == "running") {
      stages.push_back({*stage, false, "it was stopped on the way"});
    } else if (how != "done") {
      stages.push_back({*stage, false, "it failed: " + record.value("error", "")});
    } else {
      const auto earlier = std::find_if(
          names.begin(), stage, [&](const std::string& name) { return IsOutOfDate(state, *stage, name); });
      if (earlier != stage)
        stages.push_back({*stage, false, fmt::format("it is of an earlier result of stage {}", *earlier)});
    }
  }
  return stages;
}

std::string ResultOf(const nlohmann::json& state, const std::string& name) {
  const nlohmann::json record = StageRecord(state, name);
  return record.value("state", "") == "done" ? record.value("outputs", "") : "";
}

std::uint64_t Fingerprint(const fs::path& folder, const fs::path& except) {
  std::string listing;
  for (const fs::path& file : FilesBelow(folder)) {
    const std::string below = file.lexically_relative(except).string();
    if (!except.empty() && !below.empty() && !below.starts_with("..")) continue;
    listing += fmt::format("{} {} {}\n", file.lexically_relative(folder).string(), fs::file_size(file),
                           fs::last_write_time(file).time_since_epoch().count());
  }
  return Hash(listing);
}

}  // namespace polarscan
