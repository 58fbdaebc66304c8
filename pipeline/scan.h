// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/files/descriptor.h"
#include "core/progress.h"
#include "pipeline/checksums.h"
#include "pipeline/scan_state.h"

namespace polarscan {

// One stage of a scan: all that its result depends on, beside the results of the stages before it.
struct Stage {
  std::string name;                                   // one of StageNames()
  nlohmann::json options = nlohmann::json::object();  // effective ones, by name, for people too
  std::string inputs{};  // stands for the content of what else it reads; ToHex(hash)
};

// A file of a scan that is not as its stage left it.
struct ScanFinding {
  std::string stage, file, what;  // file: relative to the scan folder; empty: none in particular
  std::string moved_to{};         // by Repair
};

// A scan folder and its scan.json: which stages are done, with which options, and what came out. A stage is
// done while its options, its inputs, the program's version, the files of all stages before it and its own
// files are what they were, by checksums (pipeline/checksums.h); what earlier stages are made anew to the
// same bytes costs nothing later. scan.json is replaced atomically before and after each stage: a program
// that is killed at any moment leaves a scan that the same command goes on with. One process at a time may
// work on a scan (a lock held until the end).
class Scan {
 public:
  // Makes the folder, or goes on with the scan of the same input in it. `fingerprint` stands for the input's
  // content. Throws Error if the folder holds other files, the scan of another input, or is in use by another
  // process.
  static Scan OpenOrCreate(const std::filesystem::path& folder, const std::filesystem::path& input,
                           std::uint64_t fingerprint, Progress& progress);
  // The same for a dry run: the folder is not touched, Run only adds to plan().
  static Scan Plan(const std::filesystem::path& folder, const std::filesystem::path& input,
                   std::uint64_t fingerprint, Progress& progress);
  // Opens an existing scan to run single stages again. Throws Error if the folder holds none.
  static Scan Open(const std::filesystem::path& folder, Progress& progress);
  // The same to look at only: nothing is written, and others may work on it meanwhile.
  static Scan OpenToRead(const std::filesystem::path& folder, Progress& progress);

  std::filesystem::path views() const { return folder_ / "views"; }
  std::filesystem::path sfm() const { return folder_ / "sfm"; }
  std::filesystem::path dense() const { return folder_ / "dense"; }
  std::filesystem::path cloud() const { return folder_ / "cloud.ply"; }
  std::filesystem::path mesh() const { return folder_ / "mesh.ply"; }
  std::filesystem::path report() const { return folder_ / "report.html"; }
  const std::filesystem::path& folder() const { return folder_; }
  const std::string& input() const { return input_; }  // the fingerprint, ToHex

  // Runs the work of a stage and records what it returns ({"views": 12, ...}), unless the stage is done; one
  // that counted something "damaged" is tried again. What work throws goes on to the caller; the stage is
  // then "failed".
  using Work = std::function<nlohmann::json(Progress&)>;
  void Run(const Stage& stage, const Work& work);

  // The next Run follows stage `name`, which an earlier command has done. Throws Error if it has not, or if a
  // stage up to it was made from other results than those that are there now; files that somebody else
  // changed are warned of.
  void ContinueAfter(const std::string& name);

  // The files of a stage that is done were made anew by its own command: they are what it left, from now on.
  void RecordAgain(const std::string& stage);

  // Reads every file of the stages that are done and compares checksums, the ones of scan.json too.
  std::vector<ScanFinding> Check() const;
  // Check, and moves what is damaged or new to damaged/ below the folder: the stages are then not done any
  // more.
  std::vector<ScanFinding> Repair();

  // Sets a value of scan.json's summary, say Note("views", "registered", 12). Saved with the next stage.
  void Note(const std::string& group, const std::string& key, const nlohmann::json& value);
  void Note(const std::string& key, const nlohmann::json& value);  // null: removes it
  // What a stage returned when it was done; an empty object if it was not.
  nlohmann::json Counts(const std::string& stage) const;
  const ScanState& state() const { return state_; }
  const std::vector<PlannedStage>& plan() const { return plan_; }

 private:
  enum class Mode { kWork, kPlan };
  Scan(const std::filesystem::path& folder, Progress& progress, Mode mode = Mode::kWork);
  static Scan OpenAs(Mode mode, const std::filesystem::path& folder, Progress& progress);
  void ReadState();
  std::string InputFromHere(const std::string& input) const;
  void CheckInput(const std::string& input) const;
  std::string WhyNotDone(const Stage& stage) const;
  void AddToPlan(const Stage& stage);
  void Make(const Stage& stage, const Work& work);
  void Follow(const std::string& stage);
  void Save();

  std::filesystem::path folder_;
  Progress* progress_;
  Mode mode_ = Mode::kWork;
  ScanState state_;
  Checksums checksums_;
  std::string input_;                          // its fingerprint
  std::map<std::string, std::string> before_;  // digests of the stages so far
  std::vector<PlannedStage> plan_;
  Descriptor lock_;
};

// Names, sizes and times of change of all files below a folder, but those below `except`. Order does not
// matter.
std::uint64_t Fingerprint(const std::filesystem::path& folder, const std::filesystem::path& except);

}  // namespace polarscan
