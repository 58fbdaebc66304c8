// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/terminal.h"

namespace polarscan {

// One stage of a scan, as scan.json remembers it.
struct Stage {
  std::string name;  // "views", "sfm", "dense", "stereo", "fusion", "mesh", "report"
  std::vector<std::filesystem::path> outputs;  // files and folders that it makes, relative to the scan folder
  nlohmann::json options = nlohmann::json::object();  // effective options: what it does depends on these
};

// A scan folder and its scan.json: which stages are done, with which options, and what came out. A stage's
// hash covers the input, its options and the hash of the stage before it; so a changed option makes that
// stage and all later ones stale. scan.json is replaced atomically before and after each stage: a program
// that is killed at any moment leaves a scan that the same command goes on with. One process at a time may
// work on a scan (a lock held until the end).
class Scan {
 public:
  // Makes the folder, or goes on with the scan of the same input in it. `fingerprint` stands for the input's
  // content. Throws Error if the folder holds other files, the scan of another input, or is in use by another
  // process.
  static Scan OpenOrCreate(const std::filesystem::path& folder, const std::filesystem::path& input,
                           std::uint64_t fingerprint, Terminal& terminal);
  // Opens an existing scan to run single stages again. Throws Error if the folder holds none.
  static Scan Open(const std::filesystem::path& folder, Terminal& terminal);

  Scan(Scan&& other) noexcept;
  ~Scan();

  std::filesystem::path views() const { return folder_ / "views"; }
  std::filesystem::path sfm() const { return folder_ / "sfm"; }
  std::filesystem::path dense() const { return folder_ / "dense"; }
  std::filesystem::path cloud() const { return folder_ / "cloud.ply"; }
  std::filesystem::path mesh() const { return folder_ / "mesh.ply"; }
  std::filesystem::path report() const { return folder_ / "report.html"; }
  const std::filesystem::path& folder() const { return folder_; }

  // Runs the work of a stage and records what it returns ({"views": 12, ...}), unless the stage is done with
  // the same hash and its outputs are all there; one that counted something "damaged" is tried again. What
  // work throws goes on to the caller; the stage is then "failed".
  using Work = std::function<nlohmann::json(Progress&)>;
  void Run(const Stage& stage, const Work& work);

  // The next Run follows stage `name`, which an earlier command has done. Throws Error if it has not.
  void ContinueAfter(const std::string& name);

  // Sets a value of scan.json's summary, say Note("views", "registered", 12). Saved with the next stage.
  void Note(const std::string& group, const std::string& key, const nlohmann::json& value);
  // What a stage returned when it was done; an empty object if it was not.
  nlohmann::json Counts(const std::string& stage) const;
  const nlohmann::json& state() const { return state_; }

 private:
  Scan(const std::filesystem::path& folder, Terminal& terminal);
  bool IsDone(const Stage& stage, const std::string& hash) const;
  void Save();

  std::filesystem::path folder_;
  Terminal* terminal_;
  nlohmann::json state_;
  std::string chain_;  // hash of the input and of all stages so far
  int lock_ = -1;
};

// Names, sizes and times of change of all files below a folder, but those below `except`. Order does not
// matter.
std::uint64_t Fingerprint(const std::filesystem::path& folder, const std::filesystem::path& except);

}  // namespace polarscan
