// SPDX-License-Identifier: Apache-2.0
#include "pipeline/scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/error.h"
#include "core/files/files.h"
#include "core/files/temporaries.h"
#include "core/words.h"

namespace polarscan {
namespace fs = std::filesystem;
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

}  // namespace

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
    state_ = ReadScanState(path);
  } catch (const Error& problem) {
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
  const bool came_along = state_.input_from_here == InputFromHere(input);  // both moved, or copied
  if (!state_.input.empty() && state_.input != input && !came_along)
    throw Error(fmt::format("this is a scan of another input ({})", state_.input), folder_.string(),
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
  scan.state_.input = input_name;
  scan.state_.input_from_here = scan.InputFromHere(input_name);
  scan.state_.version = POLARSCAN_VERSION;
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
  scan.state_ = ReadScanState(folder / kFile);
  return scan;
}

// Empty if it is done.
std::string Scan::WhyNotDone(const Stage& stage) const {
  const StageRecord record = state_.Stage(stage.name);
  if (record.status == StageStatus::kNone) return "it was not made yet";
  if (record.status == StageStatus::kRunning) return "it was stopped on the way";
  if (record.status == StageStatus::kFailed) return "it failed: " + record.error;
  if (record.version != POLARSCAN_VERSION) return "another version of polarscan made it";
  if (const nlohmann::json options = state_.OptionsOf(stage.name); options != stage.options)
    return ChangedOption(options, stage.options);
  for (const auto& [name, digest] : before_)
    if (const auto before = record.before.find(name);
        before == record.before.end() || before->second != digest)
      return fmt::format("stage {} has another result now", name);
  if (record.inputs != stage.inputs) return "what it is made from has changed";
  if (const nlohmann::json damaged = Counts(stage.name).value("damaged", nlohmann::json(0)); damaged != 0)
    return fmt::format("{} damaged views were left out", ToText(damaged));
  const FileSums found = checksums_.Measure(OutputsOf(stage.name));
  if (Digest(found) == record.outputs) return "";
  const std::string difference = Difference(checksums_.Recorded(stage.name), found);
  return difference.empty() ? "its files were changed" : difference;
}

// The files of a stage, which is done, are input of the ones after it.
void Scan::Follow(const std::string& stage) { before_[stage] = state_.Stage(stage).outputs; }

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
    if (state_.stages.contains(stage.name)) progress_->Info(fmt::format("{:<8} again: {}", stage.name, why));
    Make(stage, work);
  }
  Follow(stage.name);
}

void Scan::Make(const Stage& stage, const Work& work) {
  progress_->TakeWarnings();
  const nlohmann::json options_before = state_.options;
  state_.options[stage.name] = stage.options;
  StageRecord& record = state_.stages[stage.name];
  const StageRecord record_before = std::exchange(
      record,
      StageRecord{StageStatus::kRunning, POLARSCAN_VERSION, stage.inputs, before_, "", "", nullptr, {}, 0});
  RemoveTemporariesOf(folder_, stage.name);
  Save();

  const auto begin = std::chrono::steady_clock::now();
  const auto finish = [&](StageStatus status) {
    progress_->End();
    record.status = status, record.seconds = SecondsSince(begin);
    record.warnings = progress_->TakeWarnings();
    Save();
  };
  try {
    record.counts = work(*progress_);
    const FileSums made = checksums_.Measure(OutputsOf(stage.name));
    if (FilesBelow(folder_ / OutputsOf(stage.name).front()).empty())
      throw Error("this stage left no result", (folder_ / OutputsOf(stage.name).front()).string());
    checksums_.Record(stage.name, made);
    record.outputs = Digest(made);
    finish(StageStatus::kDone);
  } catch (const Cancelled&) {
    throw;  // it stays "running": the next run goes on with it
  } catch (const std::exception& error) {
    record.error = error.what();
    try {
      const bool intact = record_before.status == StageStatus::kDone &&
                          Digest(checksums_.Measure(OutputsOf(stage.name))) == record_before.outputs;
      if (intact) {  // what was done before is there: the wrong option is forgotten
        record = record_before, state_.options = options_before;
        Save();
      } else {
        finish(StageStatus::kFailed);
      }
    } catch (const Error&) {  // of the disk that failed the stage: the first error says it all
    }
    throw;
  }
  progress_->Info(
      fmt::format("{:<8} {} ({})", stage.name, CountsText(record.counts), FormatDuration(record.seconds)));
}

void Scan::ContinueAfter(const std::string& last) {
  for (const std::string& name : StageNames()) {
    const StageRecord record = state_.Stage(name);
    if (record.status != StageStatus::kDone)
      throw Error(fmt::format("stage '{}' of this scan is not done", name), folder_.string(),
                  "Run polarscan reconstruct first; it goes on where it stopped");
    for (const auto& [earlier, digest] : record.before)
      if (before_.contains(earlier) && before_[earlier] != digest)
        throw Error(
            fmt::format("stage '{}' of this scan was made from another result of stage '{}'", name, earlier),
            folder_.string(), "Run polarscan reconstruct again, or the stages in their order");
    const FileSums found = checksums_.Measure(OutputsOf(name));
    before_[name] = Digest(found);  // a file changed by hand counts as it is
    if (!record.outputs.empty() && before_[name] != record.outputs)
      progress_->Warn(fmt::format("stage {} is taken as it is, though {}", name,
                                  Difference(checksums_.Recorded(name), found)));
    if (name == last) return;
  }
}

void Scan::RecordAgain(const std::string& stage) {
  if (state_.Stage(stage).status != StageStatus::kDone) return;
  const FileSums made = checksums_.Measure(OutputsOf(stage));
  checksums_.Record(stage, made);
  state_.stages[stage].outputs = Digest(made);
  Save();
}

std::vector<ScanFinding> Scan::Check() const {
  std::vector<ScanFinding> findings;
  const bool any = !state_.stages.empty();
  for (const std::string& stage : StageNames()) {
    if (!any && !FilesBelow(folder_ / OutputsOf(stage).front()).empty())
      findings.push_back({stage, "", "its files are there, but scan.json knows of no stage"});
    const StageRecord record = state_.Stage(stage);
    if (record.status != StageStatus::kDone) continue;
    const FileSums& recorded = checksums_.Recorded(stage);
    progress_->Begin("checking the files of " + stage, recorded.size(), "file");
    const FileSums found = checksums_.Measure(OutputsOf(stage), true, *progress_);
    const std::size_t before = findings.size();
    if (!recorded.empty())  // without, nothing is known of single files
      for (const FileDifference& d : Differences(recorded, found))
        findings.push_back({stage, d.file, d.file + " " + d.what});
    if (findings.size() == before && Digest(found) != record.outputs)
      findings.push_back(
          {stage, "",
           record.outputs.empty() ? "it was made without checksums" : "its checksums are lost or damaged"});
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
  state_.summary[group][key] = value;
}

void Scan::Note(const std::string& key, const nlohmann::json& value) {
  if (value.is_null())
    state_.summary.erase(key);
  else
    state_.summary[key] = value;
}

nlohmann::json Scan::Counts(const std::string& stage) const {
  const nlohmann::json counts = state_.Stage(stage).counts;
  return counts.is_object() ? counts : nlohmann::json::object();
}

void Scan::Save() { WriteJson(folder_ / kFile, ToJson(state_)); }

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
