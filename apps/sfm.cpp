// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "apps/command.h"
#include "pipeline/stages.h"

namespace polarscan {
namespace fs = std::filesystem;
namespace {

// The known poses that the scan was begun with, if any; also where the input lies now, if both were moved.
std::optional<std::filesystem::path> KnownPoses(const Scan& scan) {
  const nlohmann::json name = scan.state().OptionsOf("sfm").value("known-poses", nlohmann::json(""));
  if (!name.is_string() || name == "") return std::nullopt;
  const fs::path path = name.get<std::string>();
  const fs::path moved = scan.folder() / scan.state().input_from_here / "sparse";
  return !fs::exists(path) && fs::is_directory(moved) ? moved : path;
}

}  // namespace

void AddSfmCommand(CLI::App& app, Context& context) {
  struct Arguments {
    std::filesystem::path scan;
    SfmOptions sfm;
    UndistortOptions dense;
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("sfm", "Camera poses of a scan and its undistorted views, again with other options");
  command->add_option("SCAN", a->scan, "The scan's folder")->required()->check(IsFolder());
  AddOptions(*command, Table(a->sfm), kPosesGroup);
  AddOptions(*command, Table(a->dense), kUndistortGroup);
  ShowFirst(*command, {"camera-model", "single-camera", "focal", "matcher", "max-features", "min-registered",
                       "max-image-size", "masks", "depth-min", "depth-max"});
  AddExample(*command, "  polarscan sfm scan --matcher exhaustive --max-features 16384");
  command->callback([a, &context] {
    Scan scan = Scan::Open(a->scan, context.progress);
    scan.ContinueAfter("views");
    RunSfm(scan, KnownPoses(scan), WithMasksOf(a->sfm, a->dense));
    RunDense(scan, a->dense);
    context.Finish(ToJson(scan.state().Stage("sfm")),
                   fmt::format("poses: {}, in {}; next: polarscan stereo {}", (scan.sfm() / "model").string(),
                               UnitWords(UnitOf(scan)), a->scan.string()));
  });
}

}  // namespace polarscan
