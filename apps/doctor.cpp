// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>

#include "acquisition/host/disk.h"
#include "acquisition/host/network.h"
#include "acquisition/host/system.h"
#include "acquisition/host/tasks.h"
#include "acquisition/host/usb.h"
#include "apps/command.h"
#include "core/files/files.h"
#include "simulation/cameras.h"
#include "stereo/sfm/colmap/colmap.h"

namespace polarscan {
namespace fs = std::filesystem;
namespace {

class ScratchFolder {
 public:
  ScratchFolder() : path_((fs::temp_directory_path() / "polarscan-doctor-XXXXXX").string()) {
    if (!::mkdtemp(path_.data())) ThrowSystemError("cannot make a folder", fs::temp_directory_path());
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  fs::path path() const { return path_; }

 private:
  std::string path_;
};

// Throws Error if it is not there or does not answer.
HostCheck CheckColmap(Progress& progress) {
  const ScratchFolder scratch;
  const Colmap colmap("colmap", scratch.path() / "colmap.log", progress);
  return {"COLMAP", CheckState::kGood, "version " + colmap.version(), "", ""};
}

std::vector<HostTask> Tasks(const Host& host, const fs::path& folder) {
  return {
      {"cameras", 20, "polarscan cameras",
       [](Progress&) { return std::vector{CheckCameras(ListAllCameras())}; }},
      {"USB", 5, "sudo dmesg   (the kernel's messages)", [host](Progress&) { return CheckUsb(host); }},
      {"network", 5, "ip addr", [host](Progress&) { return CheckNetwork(host); }},
      {"video devices", 5, "ls -l /dev/video*", [host](Progress&) { return CheckVideoDevices(host); }},
      {"disk", 20, "polarscan doctor --folder FOLDER   (on another disk)",
       [folder](Progress& p) { return CheckDisk(folder, MeasureDisk(folder, p)); }},
      {"limits", 5, "ulimit -a", [host](Progress&) { return std::vector{CheckLimits(host)}; }},
      {"clock", 5, "timedatectl", [](Progress&) { return std::vector{CheckClock()}; }},
      {"COLMAP", 20, "sudo apt install colmap", [](Progress& p) { return std::vector{CheckColmap(p)}; }},
  };
}

std::ptrdiff_t Count(const std::vector<HostCheck>& checks, CheckState state) {
  return std::ranges::count(checks, state, &HostCheck::state);
}

// One line a check, and its fix on a line of its own. Long names (of cameras) push the rest to the right.
std::string Line(const HostCheck& check) {
  const bool is_fine = check.state == CheckState::kGood || check.state == CheckState::kNotApplicable;
  std::string text =
      fmt::format("{:<9}{:<24}  {}", check.state == CheckState::kNotApplicable ? "-" : ToString(check.state),
                  check.name, check.measured);
  if (!is_fine && !check.required.empty()) text += "; wanted: " + check.required;
  if (!check.fix.empty()) text += fmt::format("\n{:<9}  {} {}", "", is_fine ? "try:" : "fix:", check.fix);
  return text + "\n";
}

std::string Verdict(const std::vector<HostCheck>& checks) {
  const auto bad = Count(checks, CheckState::kBad), warnings = Count(checks, CheckState::kWarning);
  const std::string warned = fmt::format("{} warning{}", warnings, warnings == 1 ? "" : "s");
  if (bad > 0) return fmt::format("not ready: {} bad, {}", bad, warned);
  return warnings > 0 ? "ready; " + warned : "ready";
}

std::string TableText(const std::vector<HostCheck>& checks) {
  std::string text;
  for (const HostCheck& check : checks) text += Line(check);
  return text + Verdict(checks);
}

void Run(const std::string& folder, Context& context) {
  context.progress.Begin("looking", 0);
  const std::vector<HostCheck> checks = RunHostTasks(Tasks(Host(), fs::canonical(folder)), context.progress);
  context.not_ready = Count(checks, CheckState::kBad) > 0;
  nlohmann::json list = nlohmann::json::array();
  for (const HostCheck& check : checks) list.push_back(ToJson(check));
  context.Finish({{"ready", !context.not_ready},
                  {"bad", Count(checks, CheckState::kBad)},
                  {"warnings", Count(checks, CheckState::kWarning)},
                  {"checks", list}},
                 TableText(checks));
}

}  // namespace

void AddDoctorCommand(CLI::App& app, Context& context) {
  auto folder = std::make_shared<std::string>(".");
  CLI::App* command =
      app.add_subcommand("doctor", "Is this host ready for a camera? What to do if it is not");
  command->add_option("--folder", *folder, "Where recordings will go: its disk is measured")
      ->check(IsFolder())
      ->capture_default_str();
  AddExample(*command, "  polarscan doctor --folder /data/recordings");
  command->callback(
      [folder, &context] { DoWhole("not everything was looked at", [&] { Run(*folder, context); }); });
}

}  // namespace polarscan
