// SPDX-License-Identifier: Apache-2.0
#include "apps/scan.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include "core/error.h"
#include "core/files.h"

namespace polarscan {
namespace fs = std::filesystem;
using nlohmann::literals::operator""_json_pointer;
namespace {

constexpr const char* kFile = "scan.json";
constexpr const char* kLock = ".lock";

// The lock belongs to the open file: it ends with the process, however that ends.
int Lock(const fs::path& folder) {
  const int file = ::open((folder / kLock).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (file < 0)
    throw Error(fmt::format("cannot write to the scan folder ({})", std::strerror(errno)), folder.string(),
                "Choose a folder that you may write to");
  if (::flock(file, LOCK_EX | LOCK_NB) == 0) return file;
  ::close(file);
  throw Error("another polarscan is working on this scan", folder.string(), "Wait for it, or stop it first");
}

bool IsHidden(const fs::path& path) { return path.filename().string().starts_with('.'); }

// All regular files at or below a path, sorted; nothing if it does not exist.
std::vector<fs::path> FilesBelow(const fs::path& path) {
  std::vector<fs::path> files;
  if (fs::is_regular_file(path)) files.push_back(path);
  if (fs::is_directory(path)) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(path))
      if (entry.is_regular_file() && !IsHidden(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// Names and sizes of a stage's outputs; empty if one of them is missing.
std::string OutputListing(const fs::path& folder, const std::vector<fs::path>& outputs) {
  std::string listing;
  for (const fs::path& output : outputs) {
    const std::vector<fs::path> files = FilesBelow(folder / output);
    if (files.empty()) return "";
    for (const fs::path& file : files)
      listing += fmt::format("{} {}\n", file.lexically_relative(folder).string(), fs::file_size(file));
  }
  return ToHex(Hash(listing));
}

std::string HashStage(const Stage& stage, const std::string& before) {
  return ToHex(Hash(before + stage.name + stage.options.dump() + POLARSCAN_VERSION));
}

double SecondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// What scan.json holds of a stage; an empty object if nothing.
nlohmann::json StageRecord(const nlohmann::json& state, const std::string& stage) {
  return state.value("stages", nlohmann::json::object()).value(stage, nlohmann::json::object());
}

nlohmann::json AllWarnings(const nlohmann::json& state) {
  nlohmann::json all = nlohmann::json::array();
  for (const char* stage : {"views", "sfm", "dense", "stereo", "fusion", "mesh", "report"}) {
    const nlohmann::json warnings = StageRecord(state, stage).value("warnings", nlohmann::json::array());
    all.insert(all.end(), warnings.begin(), warnings.end());
  }
  return all;
}

// Its whole numbers: "12 registered, 3041 points".
std::string CountsText(const nlohmann::json& counts) {
  std::string text;
  for (const auto& [name, count] : counts.items())
    if (count.is_number_integer())
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count.dump(), name);
  return text;
}

}  // namespace

Scan::Scan(const fs::path& folder, Terminal& terminal)
    : folder_(folder), terminal_(&terminal), lock_(Lock(folder)) {}

Scan::Scan(Scan&& other) noexcept
    : folder_(std::move(other.folder_)),
      terminal_(other.terminal_),
      state_(std::move(other.state_)),
      chain_(std::move(other.chain_)),
      lock_(std::exchange(other.lock_, -1)) {}

Scan::~Scan() {
  if (lock_ >= 0) ::close(lock_);
}

Scan Scan::OpenOrCreate(const fs::path& folder, const fs::path& input, std::uint64_t fingerprint,
                        Terminal& terminal) {
  const std::string input_name = fs::weakly_canonical(input).string();
  const bool exists = fs::exists(folder / kFile);
  if (!exists && fs::is_directory(folder)) {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder))
      if (!IsHidden(entry.path()))
        throw Error("this folder holds other files and no scan", folder.string(),
                    "Choose a new folder with -o");
  }
  CreateFolder(folder);
  Scan scan(folder, terminal);
  if (exists) {
    scan.state_ = ReadJson(folder / kFile);
    const std::string before = scan.state_.value("input", "");
    if (before != input_name)
      throw Error(fmt::format("this is a scan of another input ({})", before), folder.string(),
                  "Choose another folder with -o");
  }
  scan.state_["input"] = input_name;
  scan.state_["version"] = POLARSCAN_VERSION;
  scan.chain_ = ToHex(fingerprint);
  scan.Save();
  return scan;
}

Scan Scan::Open(const fs::path& folder, Terminal& terminal) {
  if (!fs::exists(folder / kFile))
    throw Error("this folder holds no scan", folder.string(),
                "Make one: polarscan reconstruct INPUT -o SCAN");
  Scan scan(folder, terminal);
  scan.state_ = ReadJson(folder / kFile);
  return scan;
}

bool Scan::IsDone(const Stage& stage, const std::string& hash) const {
  const nlohmann::json record = StageRecord(state_, stage.name);
  if (record.value("state", "") != "done" || record.value("hash", "") != hash) return false;
  if (record.value("/counts/damaged"_json_pointer, 0) > 0) return false;
  const std::string listing = OutputListing(folder_, stage.outputs);
  return !listing.empty() && listing == record.value("outputs", "");
}

void Scan::Run(const Stage& stage, const Work& work) {
  terminal_->Check();
  const std::string hash = HashStage(stage, chain_);
  chain_ = hash;
  if (IsDone(stage, hash)) {
    terminal_->Info(fmt::format("{:<8} done before", stage.name));
    return;
  }
  terminal_->TakeWarnings();
  state_["options"][stage.name] = stage.options;
  state_["options_hash"] = ToHex(Hash(state_["options"].dump()));
  nlohmann::json& record = state_["stages"][stage.name];
  record = {{"state", "running"}, {"hash", hash}};
  Save();

  const auto begin = std::chrono::steady_clock::now();
  const auto finish = [&](const char* state) {
    terminal_->End();
    record["state"] = state;
    record["seconds"] = SecondsSince(begin);
    record["warnings"] = terminal_->TakeWarnings();
    Save();
  };
  try {
    record["counts"] = work(*terminal_);
    record["outputs"] = OutputListing(folder_, stage.outputs);
    if (record["outputs"] == "")
      throw Error("this stage left no result", (folder_ / stage.outputs.front()).string());
    finish("done");
  } catch (const Cancelled&) {
    throw;  // it stays "running": the next run goes on with it
  } catch (const std::exception& error) {
    record["error"] = error.what();
    try {
      finish("failed");
    } catch (
        const Error&) {  // the disk that failed the stage fails scan.json too: the first error says it all
    }
    throw;
  }
  terminal_->Info(fmt::format("{:<8} {} ({})", stage.name, CountsText(record["counts"]),
                              FormatDuration(record["seconds"].get<double>())));
}

void Scan::ContinueAfter(const std::string& name) {
  const nlohmann::json record = StageRecord(state_, name);
  if (record.value("state", "") != "done")
    throw Error(fmt::format("stage '{}' of this scan is not done", name), folder_.string(),
                "Run polarscan reconstruct first; it goes on where it stopped");
  chain_ = record.value("hash", "");
}

void Scan::Note(const std::string& group, const std::string& key, const nlohmann::json& value) {
  state_[group][key] = value;
}

nlohmann::json Scan::Counts(const std::string& stage) const {
  return StageRecord(state_, stage).value("counts", nlohmann::json::object());
}

void Scan::Save() {
  state_["warnings"] = AllWarnings(state_);
  WriteJson(folder_ / kFile, state_);
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
