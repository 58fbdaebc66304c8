// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>

#include "acquisition/input/masks.h"
#include "apps/command.h"
#include "core/error.h"
#include "core/files/files.h"
#include "core/words.h"
#include "pipeline/stages.h"
#include "report/report.h"

namespace polarscan {
namespace fs = std::filesystem;
namespace {

struct ReconstructArguments {
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

// The whole pipeline, one line a stage. Where the pictures do not make a cloud or a mesh the report says why,
// and what to shoot next.
void RunStages(Scan& scan, const Input& input, const ReconstructArguments& a) {
  RunViews(scan, input, a.demosaic);
  RunSfm(scan, input.known_model, WithMasksOf(a.sfm, a.dense));
  RunDense(scan, a.dense);
  RunStereo(scan, a.stereo);
  try {
    RunFusion(scan, a.fusion);
    if (a.make_mesh) RunMesh(scan, a.mesh);
  } catch (const NothingFound&) {
    RunReport(scan);
    throw;
  }
  RunReport(scan);
}

// Seconds of one core a megapixel of pictures or, with masks, of the object: docs/performance.md, "Time to
// expect".
double StereoRate(const std::string& preset) {
  if (preset == "fast") return 24;
  if (preset == "best") return 70;
  if (preset == "paper" || preset == "paper-real" || preset == "polarimetric-mvs") return 220;
  return preset == "colmap" || preset == "acmmp" ? 410 : 35;
}

// What stereo, which takes most of the time, would take.
nlohmann::json StereoTime(const Input& input, const ReconstructArguments& a) {
  const int longer = std::max(input.width, input.height), limit = a.dense.max_image_size;
  const double scale = limit > 0 && limit < longer ? double(limit) / longer : 1;
  const double megapixels = double(input.views.size()) * input.width * input.height * scale * scale / 1e6;
  const auto cores = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  const double rate = StereoRate(a.stereo.preset);
  return {{"megapixels", megapixels},
          {"seconds_of_a_core_per_megapixel", rate},
          {"cores", cores},
          {"seconds", megapixels * rate / double(cores)}};
}

std::string TimeText(const nlohmann::json& time, const std::string& preset) {
  return fmt::format(
      "stereo takes most of the time, here about {} on {}: {:.3g} megapixels of all views at {} s of "
      "one core (preset {}; an estimate, docs/performance.md; with masks only the object's pixels count)",
      FormatDuration(time.at("seconds").get<double>()), CountOf(time.at("cores").get<std::size_t>(), "core"),
      time.at("megapixels").get<double>(), time.at("seconds_of_a_core_per_megapixel").get<double>(), preset);
}

void ShowPlan(const Scan& scan, const nlohmann::json& time, const std::string& preset,
              const Context& context) {
  nlohmann::json plan = nlohmann::json::array();
  for (const PlannedStage& stage : scan.plan())
    plan.push_back({{"stage", stage.name}, {"done", stage.done}, {"why", stage.why}});
  const auto count = std::ranges::count(scan.plan(), false, &PlannedStage::done);
  const bool stereo = std::ranges::any_of(
      scan.plan(), [](const PlannedStage& stage) { return stage.name == "stereo" && !stage.done; });
  nlohmann::json result = {{"plan", plan}};
  if (stereo) result["stereo_time"] = time;
  context.Finish(result, (count ? fmt::format("{} stages would be made", count) : "nothing would be made") +
                             (stereo ? "\n" + TimeText(time, preset) : ""));
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

void Reconstruct(const ReconstructArguments& a, Context& context) {
  const Input input = OpenInputs(a.inputs, a.meaning, context.progress);
  context.progress.Info(fmt::format("{} views, {}", input.views.size(), ToString(input.kind)));
  RequireTwoViews(input);
  Progress silent;  // what is only odd the stage says itself
  CheckKnownPoses(input, a.dry_run ? context.progress : silent);
  if (a.dry_run) {  // else the stage of the views says that
    TellNotes(input, context.progress);
    for (const std::string& odd : CheckMasks(input, context.progress)) context.progress.Warn(odd);
  }
  const auto open = a.dry_run ? Scan::Plan : Scan::OpenOrCreate;
  Scan scan = open(a.scan, NameOf(a.inputs), FingerprintOf(a.inputs, a.scan), context.progress);
  RunStages(scan, input, a);
  context.data_lost = input.damaged() || MapsWereDamaged(scan);
  if (a.dry_run) return ShowPlan(scan, StereoTime(input, a), a.stereo.preset, context);
  if (!a.make_mesh && fs::exists(scan.mesh()) && IsOutOfDate(scan.state(), "mesh", "fusion"))
    context.progress.Warn(fmt::format("{} is of an earlier cloud; polarscan mesh {} makes it anew",
                                      scan.mesh().string(), a.scan.string()));
  context.Finish(
      ToJson(scan.state()),
      fmt::format("cloud:  {}, in {}\n{}report: {}", scan.cloud().string(), UnitWords(UnitOf(scan)),
                  a.make_mesh ? fmt::format("mesh:   {}\n", scan.mesh().string()) : "",
                  scan.report().string()));
}

}  // namespace

void AddReconstructCommand(CLI::App& app, Context& context) {
  auto a = std::make_shared<ReconstructArguments>();
  CLI::App* command =
      app.add_subcommand("reconstruct", "From pictures to a cloud, a mesh and a report; again: goes on");
  command
      ->add_option("INPUT", a->inputs,
                   "Folder of pictures or session; several become one scan (docs/input.md)")
      ->required()
      ->check(IsFolder());
  command->add_option("-o,--output", a->scan, "The scan's folder")->required()->type_name("SCAN");
  command->add_flag("--dry-run", a->dry_run, "Only says which stages would be made, and why");
  AddOptions(*command, Table(a->meaning), kInputGroup);
  AddOptions(*command, Table(a->demosaic), kDemosaicGroup);
  AddOptions(*command, Table(a->sfm), kPosesGroup);
  AddOptions(*command, Table(a->dense), kUndistortGroup);
  AddOptions(*command, Table(a->stereo), kStereoGroup);
  AddOptions(*command, Table(a->fusion), kFusionGroup);
  command->add_flag("--mesh,!--no-mesh", a->make_mesh, "Make a mesh of the cloud")->default_str("yes");
  AddOptions(*command, Table(a->mesh), kMeshGroup);
  ShowFirst(*command, {"layout", "calibration", "preset", "max-image-size", "masks", "focal", "matcher",
                       "fusion-min-views"});
  AddExample(*command,
             "  polarscan reconstruct pictures -o scan\n"
             "  polarscan reconstruct pictures -o scan --preset fast --max-image-size 800   (a first look)");
  command->callback([a, command, &context] {
    std::ranges::sort(a->inputs, {}, [](const fs::path& input) { return fs::weakly_canonical(input); });
    a->stereo = StereoOptionsFrom(*command, a->stereo, context);
    Reconstruct(*a, context);
  });
}

}  // namespace polarscan
