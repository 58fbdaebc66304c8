// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "apps/command.h"
#include "core/error.h"
#include "core/files/files.h"
#include "core/similarity.h"
#include "evaluation/evaluate_scan.h"
#include "evaluation/output/table.h"
#include "report/compare_page.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kPicturePx = 320;  // on the page

// --truth as a folder stands for its mesh.ply, with table.ply around it; in both forms sparse/ beside the
// mesh holds the true poses. What is given by itself goes first.
void FindTruth(EvaluateArguments& arguments) {
  if (fs::is_directory(arguments.truth)) {
    const fs::path table = arguments.truth / "table.ply";
    if (arguments.surroundings.empty() && fs::exists(table)) arguments.surroundings.push_back(table);
    if (!fs::exists(arguments.truth / "mesh.ply"))
      throw Error("this folder holds no mesh.ply", arguments.truth.string(),
                  "Give the true mesh itself, as PLY, STL or OBJ");
    arguments.truth /= "mesh.ply";
  }
  const fs::path sparse = arguments.truth.parent_path() / "sparse";
  if (arguments.poses.empty() && fs::is_directory(sparse)) arguments.poses = sparse;
}

// In a local frame where it lies far from 0.
Truth ReadTruth(EvaluateArguments& arguments) {
  std::vector<TriangleMesh> meshes = {ReadMesh(arguments.truth)};
  for (const fs::path& path : arguments.surroundings) meshes.push_back(ReadMesh(path));
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : meshes[0].vertices) box.extend(v);
  if (!box.isEmpty()) arguments.truth_origin = LocalOrigin(box.center(), box.diagonal().norm());
  for (TriangleMesh& mesh : meshes)
    for (Eigen::Vector3d& v : mesh.vertices) v -= arguments.truth_origin;
  TriangleMesh object = std::move(meshes[0]);
  meshes.erase(meshes.begin());
  return Truth(std::move(object), std::move(meshes));
}

// The inputs' own last names, or their whole paths where those are not different.
std::vector<std::string> Names(const std::vector<fs::path>& inputs) {
  std::vector<std::string> names;
  for (const fs::path& input : inputs) {
    const fs::path clean = fs::absolute(input).lexically_normal();
    names.push_back((clean.has_filename() ? clean : clean.parent_path()).filename().string());
  }
  const std::set<std::string> different(names.begin(), names.end());
  if (different.size() < names.size())
    std::ranges::transform(inputs, names.begin(), [](const fs::path& input) { return input.string(); });
  return names;
}

void Run(EvaluateArguments arguments, Context& context) {
  if (!arguments.html.empty())
    RequireFree(
        arguments.html, [&] { return CarriesMark(arguments.html, "content=\"polarscan evaluate\""); },
        "Choose another name with --html, or move it away");
  FindTruth(arguments);
  arguments.seed = context.seed;
  const Truth truth = ReadTruth(arguments);
  const std::vector<std::string> names = Names(arguments.inputs);
  const int picture_px = arguments.html.empty() ? 0 : kPicturePx;
  std::vector<NamedEvaluation> evaluations;
  std::vector<std::vector<ErrorPictures>> pictures;
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    Evaluated evaluated = EvaluateInput(arguments.inputs[i], arguments, truth, picture_px, context.progress);
    text += (names.size() > 1 ? names[i] + "\n" : "") + EvaluationTable(evaluated.result) + "\n";
    if (!evaluated.kept.empty())
      text += fmt::format("kept: {}; polarscan report {} shows it\n", evaluated.kept.string(),
                          arguments.inputs[i].string());
    evaluations.push_back({names[i], std::move(evaluated.result)});
    pictures.push_back(std::move(evaluated.pictures));
  }
  if (names.size() > 1) text += ComparisonTable(evaluations);
  if (!arguments.html.empty()) {
    WriteComparison(arguments.html, arguments.truth.string(), evaluations, pictures);
    text += "page: " + arguments.html.string() + "\n";
  }
  text.pop_back();
  json result = json::array();
  for (const NamedEvaluation& each : evaluations) result.push_back(ToJson(each.evaluation));
  context.Finish(names.size() == 1 ? result[0] : json{{"scans", result}}, text);
}

}  // namespace

void AddEvaluateCommand(CLI::App& app, Context& context) {
  auto arguments = std::make_shared<EvaluateArguments>();
  CLI::App* command = app.add_subcommand("evaluate", "Compares a scan or a cloud with the truth");
  command
      ->add_option("SCAN|CLOUD", arguments->inputs,
                   "Scans' folders, dense workspaces, or PLY clouds; several are compared with each other")
      ->required()
      ->check(IsFileOrFolder());
  command
      ->add_option("--truth", arguments->truth,
                   "The object's true mesh (PLY, STL or OBJ); or a folder with mesh.ply and, if there is "
                   "one, table.ply around it")
      ->required()
      ->check(IsFileOrFolder())
      ->type_name("MESH|FOLDER");
  command
      ->add_option(
          "--truth-poses", arguments->poses,
          "COLMAP model with the true poses; sparse/ beside the mesh if it is there. The scan's cameras are "
          "aligned to them by a similarity; for a cloud alone they say what is visible")
      ->check(IsFolder())
      ->type_name("SPARSE");
  command
      ->add_option(
          "--surroundings", arguments->surroundings,
          "Meshes around the object (a table): they hide parts of it, and points nearer to them than to the "
          "object do not count")
      ->check(IsFile())
      ->type_name("MESH");
  command->add_option("--cloud", arguments->cloud, "A cloud in the scan's frame; SCAN/cloud.ply if not given")
      ->check(IsFile())
      ->type_name("CLOUD");
  command->add_flag("--align,!--no-align", arguments->align,
                    "Align the cameras to the true poses, where there are any");
  command->add_flag("--maps,!--no-maps", arguments->maps, "Compare the depth and normal maps");
  command->add_flag("--keep,!--no-keep", arguments->keep,
                    "Leave the result, error pictures and curves in SCAN/evaluation, for the report");
  command
      ->add_option("--html", arguments->html,
                   "Write a page that compares the inputs: curves, table, pictures")
      ->type_name("FILE.html");
  AddOptions(*command, Table(arguments->options));
  AddExample(*command,
             "  polarscan evaluate scan --truth pictures/truth\n"
             "  polarscan evaluate fast best --truth part.stl --html compare.html");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace polarscan
