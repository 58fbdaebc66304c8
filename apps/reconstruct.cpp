// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "apps/stages.h"
#include "core/files.h"

namespace polarscan {
namespace fs = std::filesystem;
namespace {

struct Arguments {
  std::vector<fs::path> inputs;
  fs::path scan;
  InputOptions meaning;
  DemosaicOptions demosaic;
  SfmOptions sfm;
  UndistortOptions dense;
  StereoOptions stereo;
  FusionOptions fusion;
  bool make_mesh = true, dry_run = false;
  MeshOptions mesh;
};

// The whole pipeline, one line a stage.
void RunStages(Scan& scan, const Input& input, const Arguments& a) {
  RunViews(scan, input, a.demosaic);
  RunSfm(scan, input.known_model, a.sfm);
  RunDense(scan, a.dense);
  RunStereo(scan, a.stereo);
  RunFusion(scan, a.fusion);
  if (a.make_mesh) RunMesh(scan, a.mesh);
  RunReport(scan);
}

void ShowPlan(const Scan& scan, const Context& context) {
  nlohmann::json plan = nlohmann::json::array();
  for (const PlannedStage& stage : scan.plan())
    plan.push_back({{"stage", stage.name}, {"done", stage.done}, {"why", stage.why}});
  const auto count = std::ranges::count(scan.plan(), false, &PlannedStage::done);
  context.Finish({{"plan", plan}},
                 count ? fmt::format("{} stages would be made", count) : "nothing would be made");
}

// As the scan remembers its input.
fs::path NameOf(const std::vector<fs::path>& inputs) {
  std::string name;
  for (const fs::path& input : inputs)
    name += (name.empty() ? "" : " ") + fs::weakly_canonical(input).string();
  return name;
}

std::uint64_t FingerprintOf(const std::vector<fs::path>& inputs, const fs::path& scan) {
  std::uint64_t all = Fingerprint(inputs[0], scan);
  for (std::size_t i = 1; i < inputs.size(); ++i) all = Hash(ToHex(Fingerprint(inputs[i], scan)), all);
  return all;
}

void Reconstruct(const Arguments& a, Context& context) {
  const Input input = OpenInputs(a.inputs, a.meaning);
  context.progress.Info(fmt::format("{} views, {}", input.views.size(), ToString(input.kind)));
  const auto open = a.dry_run ? Scan::Plan : Scan::OpenOrCreate;
  Scan scan = open(a.scan, NameOf(a.inputs), FingerprintOf(a.inputs, a.scan), context.progress);
  RunStages(scan, input, a);
  if (a.dry_run) return ShowPlan(scan, context);
  context.data_lost = MapsWereDamaged(scan);
  context.Finish(scan.state(),
                 fmt::format("cloud:  {}\n{}report: {}", scan.cloud().string(),
                             a.make_mesh ? fmt::format("mesh:   {}\n", scan.mesh().string()) : "",
                             scan.report().string()));
}

}  // namespace

void AddReconstructCommand(CLI::App& app, Context& context) {
  auto a = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("reconstruct", "From pictures to a cloud, a mesh and a report; again: goes on");
  command
      ->add_option("INPUT", a->inputs,
                   "Folder of pictures or session; several become one scan (docs/input.md)")
      ->required()
      ->check(CLI::ExistingDirectory);
  command->add_option("-o,--output", a->scan, "The scan's folder")->required()->type_name("SCAN");
  command->add_flag("--dry-run", a->dry_run, "Only says which stages would be made, and why");
  AddOptions(*command, Table(a->meaning), "Input");
  AddOptions(*command, Table(a->demosaic), "Demosaicing");
  AddOptions(*command, Table(a->sfm), "Structure from motion");
  AddOptions(*command, Table(a->dense), "Undistortion");
  AddOptions(*command, Table(a->stereo), "Stereo");
  AddOptions(*command, Table(a->fusion), "Fusion");
  command->add_flag("--mesh,!--no-mesh", a->make_mesh, "Make a mesh of the cloud")
      ->default_str("yes")
      ->group("Mesh");
  AddOptions(*command, Table(a->mesh), "Mesh");
  command->callback([a, command, &context] {
    a->stereo = StereoOptionsFrom(*command, a->stereo, context);
    Reconstruct(*a, context);
  });
}

}  // namespace polarscan
