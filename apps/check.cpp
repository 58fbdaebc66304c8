// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "acquisition/session/session.h"
#include "apps/checks/check_input.h"
#include "apps/checks/check_session.h"
#include "core/error.h"
#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "demosaic/calibration/calibration.h"
#include "pipeline/check_files.h"
#include "pipeline/scan.h"
#include "stereo/dense/colmap/colmap_workspace.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

// What PATH is taken for, in the user's words, and how it is looked at.
struct Kind {
  std::string name;
  std::function<void(const fs::path&)> check;
};

// The COLMAP model in a folder: there, in model/ as stage sfm leaves it, or in 0/ as COLMAP does; empty if
// there is none.
fs::path ModelIn(const fs::path& folder) {
  for (const fs::path& at : {folder, folder / "model", folder / "0"})
    if (fs::exists(at / "cameras.bin") || fs::exists(at / "cameras.txt")) return at;
  return {};
}

bool IsWorkspace(const fs::path& folder) {
  return fs::exists(folder / "views.json") && fs::exists(folder / "images");
}

bool MayBeInput(const fs::path& path) {
  return fs::is_directory(path) && !IsCalibration(path) && ModelIn(path).empty() && !IsWorkspace(path);
}

Kind KindOf(const fs::path& path, Progress& progress) {
  const std::string extension = path.extension().string();
  if (fs::is_directory(path)) {
    if (IsCalibration(path)) return {"calibration", [](const fs::path& p) { ReadCalibration(p); }};
    if (!ModelIn(path).empty()) return {"sparse model", [](const fs::path& p) { CheckModel(ModelIn(p)); }};
    if (IsWorkspace(path))
      return {"dense workspace", [&progress](const fs::path& p) { CheckWorkspace(p, progress); }};
  } else {
    if (extension == ".ply") return {"cloud or mesh", CheckPly};
    if (extension == ".bin") return {"map", CheckMap};
    if (extension == ".json") return {"JSON file", [](const fs::path& p) { ReadJson(p); }};
    if (IsPictureName(path)) return {"picture", CheckPicture};
  }
  throw Error("this is nothing that polarscan can check", path.string(),
              "It checks sessions, scans, folders of pictures, dense workspaces, COLMAP's models and maps, "
              "PLY files, pictures and calibrations");
}

void CheckOne(const fs::path& path, bool repair, Context& context) {
  const Kind kind = KindOf(path, context.progress);
  std::string damage;
  try {
    kind.check(path);
  } catch (const Error& error) {
    damage = error.what();
    context.progress.Warn(damage);
  }
  context.data_lost = !damage.empty();
  if (repair && !damage.empty())
    context.progress.Info(
        "--repair works on sessions and scans: nothing is known here that this could be made from");
  context.Finish(
      {{"path", path.string()}, {"kind", kind.name}, {"sound", damage.empty()}, {"damage", damage}},
      fmt::format("{}: {}", kind.name, damage.empty() ? "sound" : "damaged"));
}

nlohmann::json ToJson(const std::vector<ScanFinding>& findings) {
  nlohmann::json list = nlohmann::json::array();
  for (const ScanFinding& f : findings)
    list.push_back({{"stage", f.stage}, {"file", f.file}, {"what", f.what}, {"moved_to", f.moved_to}});
  return list;
}

void CheckScan(const fs::path& path, bool repair, Context& context) {
  Scan scan = repair ? Scan::Open(path, context.progress) : Scan::OpenToRead(path, context.progress);
  const std::vector<ScanFinding> findings = repair ? scan.Repair() : scan.Check();
  for (const ScanFinding& f : findings)
    context.progress.Warn(
        fmt::format("{}: {}{}", f.stage, f.what, f.moved_to.empty() ? "" : ", moved to " + f.moved_to));
  std::vector<std::string> old;  // no damage, since each stage can be run by itself
  for (const PlannedStage& stage : OutOfDateStages(scan.state())) {
    old.push_back(stage.name);
    context.progress.Warn(fmt::format("{}: out of date, {}", stage.name, stage.why));
  }
  context.data_lost = !findings.empty();
  const std::string advice =
      fmt::format("; polarscan reconstruct {} -o {}, with its options, makes that again",
                  scan.state().input.empty() ? "INPUT" : scan.state().input, path.string());
  context.Finish({{"path", path.string()},
                  {"kind", "scan"},
                  {"sound", findings.empty()},
                  {"damage", ToJson(findings)},
                  {"out_of_date", old}},
                 findings.empty() ? fmt::format("scan: every file is as the stages left it{}",
                                                old.empty() ? "" : "; what is out of date is named above")
                                  : fmt::format("scan: {} things are wrong{}", findings.size(), advice));
}

void Check(const fs::path& path, bool repair, const InputOptions& options, Context& context) {
  if (IsSession(path.string())) return CheckSession(path.string(), repair, context);
  if (fs::exists(path / "scan.json")) return CheckScan(path, repair, context);
  if (MayBeInput(path)) return CheckInputFolder(path, options, context);
  CheckOne(path, repair, context);
}

}  // namespace

void AddCheckCommand(CLI::App& app, Context& context) {
  struct Arguments {
    fs::path path;
    bool repair = false;
    InputOptions options;
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("check", "Is this sound? What was lost? Sessions, scans, and their files");
  command
      ->add_option("PATH", a->path,
                   "A session, a scan, a folder of pictures, a dense workspace, a COLMAP model, a "
                   "calibration, a map, a PLY file or a picture")
      ->required()
      ->check(IsFileOrFolder());
  command->add_flag("--repair", a->repair,
                    "Session: cut off what was not finished and close it. Scan: move damaged files to "
                    "SCAN/damaged, so that reconstruct makes them again");
  AddOptions(*command, Table(a->options), kInputGroup);
  ShowFirst(*command, {"layout", "bits", "input-kind"});
  AddExample(*command,
             "  polarscan check pictures\n  polarscan check scan\n  polarscan check session --repair");
  command->callback([a, &context] {
    DoWhole("nothing was changed", [&] { Check(a->path, a->repair, a->options, context); });
  });
}

}  // namespace polarscan
