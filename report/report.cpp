// SPDX-License-Identifier: Apache-2.0
#include "report/report.h"

#include <optional>

#include "core/error.h"
#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "core/words.h"
#include "demosaic/false_colour.h"
#include "evaluation/output/files.h"
#include "evaluation/output/plots.h"
#include "fusion/cloud/fuse.h"
#include "pipeline/scan.h"
#include "report/findings.h"
#include "report/page_text.h"
#include "report/pages.h"
#include "report/scene/cloud.h"
#include "report/scene/mesh.h"
#include "report/scene/views.h"

namespace fs = std::filesystem;
using nlohmann::json;

namespace polarscan {
namespace {

constexpr std::size_t kMostPoints = 400'000, kMostFaces = 250'000;
constexpr int kLegendSize = 256;

json Legends() {
  return {{"heat", PaletteBase64(HeatPalette())},
          {"ramp", PaletteBase64(RampPalette())},
          {"wheel", Base64(EncodeJpeg(AopWheel(kLegendSize), 92))},
          {"ball", Base64(EncodeJpeg(NormalBall(kLegendSize), 92))}};
}

// What read() gives, or nothing, and why in `notes`.
template <class T, class Read>
T Try(json& notes, Read&& read) {
  try {
    return read();
  } catch (const Error& error) {
    notes.push_back(error.what());
    return {};
  }
}

// What `polarscan evaluate` found; none if it was not run, or not on this cloud.
std::optional<Evaluation> CurrentEvaluation(const fs::path& scan, const ScanState& state, json& notes) {
  const fs::path file = EvaluationJsonPath(EvaluationFolder(scan));
  if (!fs::exists(file)) return std::nullopt;
  Evaluation evaluation = ReadEvaluation(file);
  if (!evaluation.cloud_hash.empty() && fs::exists(scan / "cloud.ply") &&
      evaluation.cloud_hash != ToHex(HashFile(scan / "cloud.ply"))) {
    notes.push_back("The evaluation is of an earlier cloud and left out; run polarscan evaluate again.");
    return std::nullopt;
  }
  if (evaluation.maps && evaluation.maps_result && *evaluation.maps_result != ResultOf(state, "stereo")) {
    notes.push_back("The evaluation is of earlier maps and left out; run polarscan evaluate again.");
    return std::nullopt;
  }
  return evaluation;
}

// The cloud is shown all the same.
void TellOldCloud(const ScanState& state, json& notes) {
  for (const PlannedStage& stage : OutOfDateStages(state))
    if (stage.name == "fusion")
      notes.push_back("The cloud is not of these maps (" + stage.why + "); run polarscan fuse again.");
}

CloudSample ReadCloud(const fs::path& scan, bool evaluated, const Eigen::Matrix3d& display_from_world,
                      json& notes) {
  const fs::path ply = scan / "cloud.ply", errors = CloudErrorsPath(EvaluationFolder(scan));
  if (!fs::exists(ply)) {
    notes.push_back("There is no cloud yet.");
    return {};
  }
  return Try<CloudSample>(notes, [&] {
    return SampleCloud(ply, evaluated && fs::exists(errors) ? errors : fs::path(), kMostPoints,
                       display_from_world);
  });
}

std::vector<CameraPlace> CamerasAround(const CloudSample& sample, const json& views) {
  std::vector<CameraPlace> cameras;
  for (std::size_t i = 0; i < views.size() && !sample.empty(); ++i) {
    if (!views[i].contains("camera")) continue;
    const Eigen::Vector3d center = FromArray(views[i].at("camera").at("center"));
    cameras.push_back(
        {int(i), views[i].at("name").get<std::string>(), (center - sample.center).normalized()});
  }
  return cameras;
}

// Leaves out a mesh of an earlier cloud, with all that scan.json says of it.
ReportMesh MeshOfCloud(const fs::path& folder, const ScanState& state, json& scan,
                       const Eigen::Matrix3d& display, const CloudSample& sample, const ReportCloud& cloud,
                       json& notes) {
  const fs::path ply = folder / "mesh.ply";
  if (!fs::exists(ply)) return {};
  if (!IsOutOfDate(state, "mesh", "fusion"))
    return Try<ReportMesh>(notes, [&] { return PackMesh(ply, kMostFaces, display, sample, cloud); });
  notes.push_back(ResultOf(state, "mesh").empty()
                      ? "The mesh was not finished and is left out; run polarscan mesh again."
                      : "The mesh is of an earlier cloud and left out; run polarscan mesh again.");
  scan.erase("mesh");
  if (state.Stage("mesh").status == StageStatus::kDone) scan["stages"].erase("mesh");
  return {};
}

// fusion-min-views, if scan.json says so.
int MinViews(const ScanState& state) {
  return state.OptionsOf("fusion").value("fusion-min-views", FusionOptions().min_views);
}

std::string NameOf(const fs::path& folder) {
  const fs::path clean = fs::absolute(folder).lexically_normal();
  return (clean.has_filename() ? clean : clean.parent_path()).filename().string();
}

}  // namespace

void WriteReport(const fs::path& scan_folder, const fs::path& html, Progress& progress) {
  if (!fs::exists(scan_folder / "scan.json"))
    throw Error("not a scan folder (no scan.json)", scan_folder.string(),
                "Give the folder that `polarscan reconstruct INPUT -o SCAN` made");
  const ScanState state = ReadScanState(scan_folder / "scan.json");
  json data = {
      {"name", NameOf(scan_folder)}, {"scan", ReadJson(scan_folder / "scan.json")}, {"legends", Legends()}};
  ReportPictures views = CollectViews(scan_folder, progress);
  json& notes = data["notes"] = views.notes;
  if (const json offset = data["scan"].value("offset", json()); offset.is_array())
    notes.push_back("Coordinates are in a local frame: add " + offset.dump() +
                    " for those of the poses given.");
  const auto evaluation =
      Try<std::optional<Evaluation>>(notes, [&] { return CurrentEvaluation(scan_folder, state, notes); });
  TellOldCloud(state, notes);
  const Eigen::Matrix3d& display = views.display_from_world;
  const CloudSample sample = ReadCloud(scan_folder, evaluation.has_value(), display, notes);
  const ReportCloud cloud = sample.empty() ? ReportCloud() : PackCloud(sample);
  progress.Check();
  const ReportMesh mesh = MeshOfCloud(scan_folder, state, data["scan"], display, sample, cloud, notes);
  progress.Check();
  data["findings"] = Findings({sample, CamerasAround(sample, views.views), views.dop_noise, MinViews(state),
                               data["scan"], views.views});
  data["views"] = std::move(views.views);
  data["dop_full"] = views.dop_full;
  data["cloud"] = cloud.facts;
  data["mesh"] = mesh.facts;
  data["evaluation"] = nullptr;
  data["curves"] = json::array();
  if (evaluation) {
    data["evaluation"] = ToJson(*evaluation);
    for (const CurveDrawing& drawing : DrawCurves({{"", *evaluation}})) data["curves"].push_back(drawing.svg);
  }
  WriteFileAtomically(html, Fill(kReportHtml, {{"{{title}}", EscapeHtml(NameOf(scan_folder))},
                                               {"{{style}}", kReportCss},
                                               {"{{data}}", EscapeJson(data)},
                                               {"{{cloud}}", Base64(cloud.bytes)},
                                               {"{{mesh}}", Base64(mesh.bytes)},
                                               {"{{scripts}}", kReportScripts}}));
}

void RunReport(Scan& scan) {
  nlohmann::json shown = scan.state().options;  // of all stages
  shown.erase("report");
  scan.Run({"report", nlohmann::json::object(), ToHex(Hash(ToText(shown)))},
           [&](Progress& progress) -> nlohmann::json {
             WriteReport(scan.folder(), scan.report(), progress);
             return nlohmann::json::object();
           });
}

}  // namespace polarscan
