// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "apps/command.h"
#include "core/error.h"
#include "core/files/files.h"
#include "fusion/mesh_files.h"
#include "pipeline/stages.h"

namespace polarscan {
namespace fs = std::filesystem;
namespace {

struct MeshArguments {
  fs::path scan, output;
  bool dry_run = false;
  MeshOptions options;
};

void DryRun(const MeshArguments& arguments, Context& context) {
  const MeshSummary plan = PlanMesh(arguments.scan / "cloud.ply", arguments.options);
  context.Finish({{"points", plan.points}, {"depth", plan.depth}, {"cell", plan.cell}},
                 fmt::format("would mesh {} points at octree depth {} (cells of {:.3g}) into {}", plan.points,
                             plan.depth, plan.cell, (arguments.scan / "mesh.ply").string()));
}

// A mesh that -o made before may be replaced, but no other scan's.
void RequireFreeOutput(const MeshArguments& arguments) {
  const fs::path& file = arguments.output;
  const fs::path folder = fs::absolute(file).parent_path();
  const bool is_a_scans = file.filename() == "mesh.ply" && fs::exists(folder / "scan.json");
  RequireFree(file,
              [&] { return IsMeshFile(file) && (!is_a_scans || fs::equivalent(folder, arguments.scan)); });
}

void Run(const MeshArguments& arguments, Context& context) {
  if (!arguments.output.empty()) {
    CheckMeshFileName(arguments.output);
    RequireFreeOutput(arguments);
    const fs::path below =
        fs::weakly_canonical(arguments.output).lexically_relative(fs::weakly_canonical(arguments.scan));
    if (!below.empty() && *below.begin() != "..")
      throw Error("this lies in the scan, whose files are the stages' own", arguments.output.string(),
                  "Without -o the mesh is SCAN/mesh.ply; give -o a name elsewhere");
  }
  Scan scan = Scan::Open(arguments.scan, context.progress);
  scan.ContinueAfter("fusion");
  if (arguments.dry_run) return DryRun(arguments, context);
  RunMesh(scan, arguments.options);
  const fs::path file = arguments.output.empty() ? scan.mesh() : arguments.output;
  if (!arguments.output.empty()) WriteMeshFile(file, ReadSurfaceMesh(scan.mesh()));
  if (file.extension() == ".stl" && !UnitOf(scan).IsKnown())
    context.progress.Info(
        "STL has no unit, and slicers take millimetres: these lengths are in the unit of the scan's poses");
  nlohmann::json result = scan.Counts("mesh");
  result["mesh"] = file.string();
  context.Finish(result, fmt::format("{} triangles, {}, in {}: {}", result.at("faces").get<std::size_t>(),
                                     result.at("watertight").get<bool>() ? "watertight" : "with borders",
                                     UnitWords(UnitOf(scan)), file.string()));
}

}  // namespace

void AddMeshCommand(CLI::App& app, Context& context) {
  auto arguments = std::make_shared<MeshArguments>();
  CLI::App* command = app.add_subcommand("mesh", "A mesh of a scan's cloud: SCAN/mesh.ply");
  command->add_option("SCAN", arguments->scan, "The scan's folder")->required()->check(IsFolder());
  command->add_option("-o,--output", arguments->output, "Also writes the mesh here: .ply, .obj, .glb or .stl")
      ->type_name("FILE");
  command->add_flag("--dry-run", arguments->dry_run, "Only says what it would do");
  AddOptions(*command, Table(arguments->options), kMeshGroup);
  ShowFirst(*command, {"mesh-depth", "mesh-fill-holes", "mesh-trim", "faces", "refine"});
  AddExample(*command,
             "  polarscan mesh scan --faces 100000 -o cup.glb\n"
             "  polarscan mesh scan --mesh-fill-holes 1000 -o cup.stl    (watertight, for a printer)");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace polarscan
