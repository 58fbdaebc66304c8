// SPDX-License-Identifier: Apache-2.0
#include "apps/stages.h"

#include "apps/report.h"
#include "apps/views.h"
#include "core/error.h"
#include "core/files.h"
#include "fusion/surface_maps.h"
#include "stereo/workspace.h"

namespace polarscan {
namespace fs = std::filesystem;
namespace {

// Names and contents.
std::string HashOfFiles(const fs::path& folder) {
  std::uint64_t hash = 0;
  for (const fs::path& file : FilesBelow(folder)) hash = HashFile(file, Hash(file.filename().string(), hash));
  return ToHex(hash);
}

}  // namespace

void RunViews(Scan& scan, const Input& input, const DemosaicOptions& options) {
  DemosaicOptions effective = options;
  const Stage stage{
      "views", {{"input", Meaning(input)}, {"demosaic", ToJson(Table(effective))}}, scan.input()};
  scan.Run(stage, [&](Progress& progress) -> nlohmann::json {
    MakeStokesViews(input, scan.views(), options, progress);
    scan.Note("views", "total", input.views.size());
    scan.Note("views", "polarized", input.polarized());
    return {{"views", input.views.size()}};
  });
}

void RunSfm(Scan& scan, const std::optional<fs::path>& known_model, const SfmOptions& options) {
  SfmOptions effective = options;
  Stage stage{"sfm", ToJson(Table(effective))};
  stage.options["known-poses"] = known_model ? known_model->string() : "";
  if (known_model) stage.inputs = HashOfFiles(*known_model);
  scan.Run(stage, [&](Progress& progress) -> nlohmann::json {
    const SparseModel model = EstimatePoses(scan.views(), scan.sfm(), known_model, options, progress);
    scan.Note("views", "registered", model.images.size());
    return {{"registered", model.images.size()}, {"points", model.points.size()}};
  });
}

void RunDense(Scan& scan, const UndistortOptions& options) {
  UndistortOptions effective = options;
  scan.Run({"dense", ToJson(Table(effective))}, [&](Progress& progress) -> nlohmann::json {
    Undistort(scan.views(), ReadSparseModel(scan.sfm() / "model"), scan.dense(), options, progress);
    return {{"views", ReadWorkspace(scan.dense()).views.size()}};
  });
}

void RunStereo(Scan& scan, const StereoOptions& options) {
  StereoOptions effective = options;
  scan.Run({"stereo", ToJson(Table(effective))}, [&](Progress& progress) -> nlohmann::json {
    EstimateMaps(scan.dense(), options, progress);
    return {{"views", ChosenViews(ReadWorkspace(scan.dense()), options.views).views.size()}};
  });
}

void RunFusion(Scan& scan, const FusionOptions& options) {
  FusionOptions effective = options;
  scan.Run({"fusion", ToJson(Table(effective))}, [&](Progress& progress) -> nlohmann::json {
    const CloudSummary cloud = FuseCloud(scan.dense(), scan.cloud(), options, progress);
    scan.Note("cloud", "points", cloud.points);
    return ToJson(cloud);
  });
}

void RunMesh(Scan& scan, const MeshOptions& options) {
  MeshOptions effective = options;
  scan.Run({"mesh", ToJson(Table(effective))}, [&](Progress& progress) -> nlohmann::json {
    const MeshSummary mesh = MakeMesh(scan.cloud(), scan.dense(), scan.mesh(), options, progress);
    scan.Note("mesh", "faces", mesh.faces);
    return ToJson(mesh);
  });
}

void RunReport(Scan& scan) {
  nlohmann::json shown =
      scan.state().value("options", nlohmann::json::object());  // the options of all stages
  shown.erase("report");
  scan.Run({"report", nlohmann::json::object(), ToHex(Hash(ToText(shown)))},
           [&](Progress& progress) -> nlohmann::json {
             WriteReport(scan.folder(), scan.report(), progress);
             return nlohmann::json::object();
           });
}

bool MapsWereDamaged(const Scan& scan) {
  return scan.Counts("fusion").value("damaged", nlohmann::json(0)) > 0;
}

StereoOptions RecordedStereoOptions(const Scan& scan) {
  const nlohmann::json::json_pointer place("/options/stereo");
  if (!scan.state().contains(place))
    throw Error("the scan does not say how its maps were made", (scan.folder() / "scan.json").string(),
                "Run polarscan stereo " + scan.folder().string());
  StereoOptions options;
  OptionTable table = Table(options);
  FromJson(scan.state().at(place), table);
  return options;
}

StereoOptions StereoOptionsFrom(const CLI::App& command, StereoOptions parsed, const Context& context) {
  StereoOptions options = StereoPreset(parsed.preset);
  OptionTable table = Table(options);
  FromJson(GivenOptions(command, Table(parsed)), table);
  options.seed = int(context.seed);
  return options;
}

}  // namespace polarscan
