// SPDX-License-Identifier: Apache-2.0
#include "fusion/evaluate.h"

#include <fmt/format.h>

#include <optional>

#include "apps/command.h"
#include "apps/evaluation_table.h"
#include "core/error.h"
#include "fusion/alignment.h"
#include "fusion/cloud.h"
#include "fusion/maps.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct EvaluateArguments {
  fs::path input, truth, poses, cloud;
  std::vector<fs::path> surroundings;
  bool align = true, maps = true;
  EvaluateOptions options;
};

// --truth as a folder stands for its mesh.ply, with table.ply around it; in both forms sparse/ beside the
// mesh holds the true poses. What is given by itself goes first.
void FindTruth(EvaluateArguments& arguments) {
  if (fs::is_directory(arguments.truth)) {
    const fs::path table = arguments.truth / "table.ply";
    if (arguments.surroundings.empty() && fs::exists(table)) arguments.surroundings.push_back(table);
    arguments.truth /= "mesh.ply";
  }
  const fs::path sparse = arguments.truth.parent_path() / "sparse";
  if (arguments.poses.empty() && fs::is_directory(sparse)) arguments.poses = sparse;
}

Truth ReadTruth(const EvaluateArguments& arguments) {
  std::vector<TriangleMesh> surroundings;
  for (const fs::path& path : arguments.surroundings) surroundings.push_back(ReadMesh(path));
  return Truth(ReadMesh(arguments.truth), std::move(surroundings));
}

std::vector<DenseView> Cameras(const SparseModel& model) {
  std::vector<DenseView> views;
  for (const auto& [id, image] : model.images)
    views.push_back(
        {image.name, ToPinhole(model.cameras.at(image.camera_id)), image.cam_from_world, 0, 0, {}});
  return views;
}

std::vector<DenseView> Moved(std::vector<DenseView> views, const Similarity& similarity) {
  for (DenseView& view : views) view.cam_from_world = similarity(view.cam_from_world);
  return views;
}

json EvaluateCloudFile(const fs::path& cloud, const Similarity& truth_from_scan,
                       const std::vector<DenseView>& cameras, const Truth& truth,
                       const EvaluateArguments& arguments, Context& context) {
  CloudPositions positions = ReadCloudPositions(cloud);
  if (positions.not_finite > 0)
    context.progress.Warn(fmt::format("{} points without a finite position are left out: {}",
                                      positions.not_finite, cloud.string()));
  for (Eigen::Vector3d& p : positions.points) p = truth_from_scan * p;
  return EvaluateCloud(positions.points, cameras, truth, arguments.options, context.seed, context.progress);
}

json EvaluateScan(const fs::path& dense, const EvaluateArguments& arguments, const Truth& truth,
                  Context& context) {
  const Workspace workspace = ReadWorkspace(dense);
  json result;
  Similarity truth_from_scan;
  if (arguments.align && !arguments.poses.empty()) {
    const Alignment alignment = AlignCameras(Poses(workspace), Poses(ReadSparseModel(arguments.poses)));
    truth_from_scan = alignment.truth_from_scan;
    result["alignment"] = ToJson(alignment);
  } else {
    context.progress.Info("no true poses: the scan is compared in its own frame");
  }
  if (arguments.maps)
    result["maps"] = EvaluateMaps(workspace, truth_from_scan, truth, arguments.options, context.progress);
  const fs::path cloud = arguments.cloud.empty() ? arguments.input / "cloud.ply" : arguments.cloud;
  if (fs::exists(cloud) || !arguments.cloud.empty())
    result["cloud"] = EvaluateCloudFile(cloud, truth_from_scan, Moved(workspace.views, truth_from_scan),
                                        truth, arguments, context);
  return result;
}

json EvaluateCloudAlone(const EvaluateArguments& arguments, const Truth& truth, Context& context) {
  const auto cameras =
      arguments.poses.empty() ? std::vector<DenseView>() : Cameras(ReadSparseModel(arguments.poses));
  return {{"cloud", EvaluateCloudFile(arguments.input, {}, cameras, truth, arguments, context)}};
}

void Run(EvaluateArguments arguments, Context& context) {
  FindTruth(arguments);
  const Truth truth = ReadTruth(arguments);
  json result;
  if (!fs::is_directory(arguments.input)) {
    result = EvaluateCloudAlone(arguments, truth, context);
  } else {
    const bool scan = fs::exists(arguments.input / "dense/views.json");
    result = EvaluateScan(scan ? arguments.input / "dense" : arguments.input, arguments, truth, context);
  }
  result["input"] = arguments.input.string();
  result["truth"] = arguments.truth.string();
  context.Finish(result, EvaluationTable(result));
}

}  // namespace

void AddEvaluateCommand(CLI::App& app, Context& context) {
  auto arguments = std::make_shared<EvaluateArguments>();
  CLI::App* command = app.add_subcommand("evaluate", "Compares a scan or a cloud with the truth");
  command->add_option("SCAN|CLOUD", arguments->input, "A scan's folder, a dense workspace, or a PLY cloud")
      ->required()
      ->check(CLI::ExistingPath);
  command
      ->add_option(
          "--truth", arguments->truth,
          "The object's true mesh (PLY); or a folder with mesh.ply and, if there is one, table.ply around it")
      ->required()
      ->check(CLI::ExistingPath)
      ->type_name("MESH|FOLDER");
  command
      ->add_option(
          "--truth-poses", arguments->poses,
          "COLMAP model with the true poses; sparse/ beside the mesh if it is there. The scan's cameras are "
          "aligned to them by a similarity; for a cloud alone they say what is visible")
      ->check(CLI::ExistingDirectory)
      ->type_name("SPARSE");
  command
      ->add_option(
          "--surroundings", arguments->surroundings,
          "Meshes around the object (a table): they hide parts of it, and points nearer to them than to the "
          "object do not count")
      ->check(CLI::ExistingFile)
      ->type_name("MESH");
  command->add_option("--cloud", arguments->cloud, "A cloud in the scan's frame; SCAN/cloud.ply if not given")
      ->check(CLI::ExistingFile)
      ->type_name("CLOUD");
  command->add_flag("--align,!--no-align", arguments->align,
                    "Align the cameras to the true poses, where there are any");
  command->add_flag("--maps,!--no-maps", arguments->maps, "Compare the depth and normal maps");
  AddOptions(*command, Table(arguments->options));
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace polarscan
