// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/files/files.h"
#include "core/words.h"
#include "demosaic/sensor/layout.h"
#include "pipeline/stereo/corrections/aop_check.h"
#include "pipeline/stereo/corrections/polarization_fit.h"
#include "pipeline/stereo/corrections/pose_refinement.h"
#include "pipeline/stereo/stereo.h"
#include "pipeline/views/views.h"
#include "stereo/dense/masks/mask_fit.h"
#include "stereo/sfm/check_poses.h"
#include "stereo/sfm/known_poses.h"
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

// The option that counts a scan's angles another way. input: of scan.json's options.
std::string CureOfAngles(AopCount count, const nlohmann::json& input) {
  const bool mirrored = count != AopCount::kShifted, shifted = count != AopCount::kMirrored;
  if (input.value("kind", "") == "mosaic") {
    Layout layout = ParseLayout(input.at("sensor").at("layout"));
    for (int& angle : layout.angles_deg)
      angle = ((mirrored ? -angle : angle) + (shifted ? 45 : 0) + 180) % 180;
    const std::string cure = ToString(layout);
    for (int& angle : layout.angles_deg) angle = (angle + 90) % 180;
    return fmt::format(
        "Run again with --layout \"{}\" or \"{}\", whichever is the sensor's: the shape cannot tell them "
        "apart",
        cure, ToString(layout));
  }
  const bool clockwise = input.value("aop_sense", "") == "clockwise";
  return (mirrored ? fmt::format("Run again with --aop-sense {}", clockwise ? "anticlockwise" : "clockwise")
                   : "Look which picture belongs to which angle") +
         (mirrored && shifted ? ", and look which picture belongs to which angle" : "");
}

constexpr const char* kWays[] = {"", "the other way", "45 degrees on", "the other way and 45 degrees on"};

std::string AnglesDoNotFit(AopCount count, const nlohmann::json& input) {
  return fmt::format(
      "the angles of polarization do not fit the shape that the views agree on; counted {} they would. {}{}",
      kWays[std::size_t(count)], CureOfAngles(count, input),
      input.value("kind", "") == "mosaic" ? "; polarscan calibrate layout finds out how a sensor counts"
                                          : "");
}

// What stereo mended, and how to say it from the start where an option does. views: options of that stage.
std::string AnglesWereCorrected(const PolarizationCorrection& correction, const nlohmann::json& views) {
  constexpr double kShiftDeg = 45, kNearDeg = 5;
  std::string words = CorrectionWords(correction);
  const bool shifted = std::abs(std::abs(correction.turn_deg) - kShiftDeg) < kNearDeg;
  if (correction.mirrored || shifted) {
    const AopCount count = !shifted              ? AopCount::kMirrored
                           : correction.mirrored ? AopCount::kMirroredAndShifted
                                                 : AopCount::kShifted;
    words += ". " + CureOfAngles(count, views.value("input", nlohmann::json::object()));
  }
  return words;
}

// Of views that are not as the others.
std::string AnglesOfSomeDoNotFit(const AopFits& fits) {
  std::vector<std::string> names;
  for (const auto& [name, fit] : fits.odd) names.push_back(name);
  return fmt::format(
      "the angles of polarization of {} do not fit the shape that the other views agree on; counted {} they "
      "would. Are {} turned, mirrored or cut at an odd pixel, another camera's, or under another view's "
      "pose? Take {} out, or save {} anew",
      Enumerate(names), kWays[std::size_t(fits.odd.begin()->second.other)],
      names.size() == 1 ? "its pictures" : "their pictures", names.size() == 1 ? "it" : "them",
      names.size() == 1 ? "it" : "them");
}

// Asks the maps whether the angles are counted as they were said to be; what is wrong is said, and told to
// the report.
nlohmann::json CheckAngles(const Scan& scan, const Workspace& workspace, const StereoOptions& options,
                           Progress& progress) {
  const AopFits fits = CheckAop(workspace, options, progress);
  const AopFit& fit = fits.all;
  nlohmann::json counts = ToJson(fit);
  for (const auto& [name, own] : fits.odd) counts["odd"][name] = ToJson(own);
  if (!fits.odd.empty()) {
    counts["advice"] = AnglesOfSomeDoNotFit(fits);
    progress.Warn(counts["advice"].get<std::string>());
  }
  if (!fit.IsWrong()) return counts;
  const nlohmann::json views = scan.state().OptionsOf("views");
  counts["advice"] = AnglesDoNotFit(fit.other, views.value("input", nlohmann::json::object()));
  progress.Warn(counts["advice"].get<std::string>());
  return counts;
}

}  // namespace

void CheckKnownPoses(const Input& input, Progress& progress) {
  if (!input.known_model) return;
  const bool one_size = input.kind != InputKind::kPhotos;  // photos may differ, and be turned
  std::vector<ListedView> views;
  for (const InputView& view : input.views)
    views.push_back({view.name, one_size ? input.width : 0, one_size ? input.height : 0});
  std::ranges::sort(views, {}, &ListedView::name);
  CheckKnownPoses(ReadKnownPoses(*input.known_model, views, progress),
                  input.known_model->lexically_normal().string(), false, progress);
}

void RequireTwoViews(const Input& input) {
  if (input.views.size() > 1) return;
  throw Error("there is only one view, and depth needs two at least", input.folder.string(),
              "Take pictures from all around the object, with much overlap");
}

SfmOptions WithMasksOf(SfmOptions options, const UndistortOptions& dense) {
  if (!dense.masks && options.masks == "auto") options.masks = "no";
  return options;
}

void RunViews(Scan& scan, const Input& input, const DemosaicOptions& options) {
  const Stage stage{"views", {{"input", Meaning(input)}, {"demosaic", ValuesOf(options)}}, scan.input()};
  scan.Run(stage, [&](Progress& progress) -> nlohmann::json {
    MakeStokesViews(input, scan.views(), options, progress);
    scan.Note("views", "total", input.views.size());
    scan.Note("views", "polarized", input.polarized());
    return {{"views", input.views.size()}};
  });
}

void RunSfm(Scan& scan, const std::optional<fs::path>& known_model, const SfmOptions& options) {
  Stage stage{"sfm", ValuesOf(options)};
  stage.options["known-poses"] = known_model ? fs::weakly_canonical(*known_model).string() : "";
  if (known_model) stage.inputs = HashOfFiles(*known_model);
  scan.Run(stage, [&](Progress& progress) -> nlohmann::json {
    const SparseModel model = EstimatePoses(scan.views(), scan.sfm(), known_model, options, progress);
    scan.Note("views", "registered", model.images.size());
    const Eigen::Vector3d& offset = model.offset;
    scan.Note("offset",
              offset.isZero(0) ? nlohmann::json() : nlohmann::json{offset.x(), offset.y(), offset.z()});
    const LengthUnit unit = UnitOfPoses(scan.sfm());
    scan.Note("unit", unit.unit);
    scan.Note("unit_source", unit.IsKnown() ? nlohmann::json(unit.source) : nlohmann::json());
    scan.Note("unit_sigma", unit.IsKnown() ? nlohmann::json(unit.sigma) : nlohmann::json());
    return {{"registered", model.images.size()}, {"points", model.points.size()}};
  });
}

void RunDense(Scan& scan, const UndistortOptions& options) {
  scan.Run({"dense", ValuesOf(options)}, [&](Progress& progress) -> nlohmann::json {
    const MaskNotes masks =
        Undistort(scan.views(), ReadSparseModel(scan.sfm() / "model"), scan.dense(), options, progress);
    const Workspace workspace = ReadWorkspace(scan.dense());
    const std::string doubt = MaskFitWords(MasksThatDoNotFit(workspace, progress));
    if (!doubt.empty()) progress.Warn(doubt);
    nlohmann::json counts = {{"views", workspace.views.size()}};
    if (const std::string found = FoundMasksWords(masks.found); !found.empty()) {
      if (masks.found.views > 0) counts["masks"]["found"] = found;
      progress.Info(found);
    }
    if (const std::string mended = MaskMendingWords(masks.mending); !mended.empty()) {
      counts["masks"]["mended"] = mended;
      progress.Warn(mended);
    }
    return counts;
  });
}

void RunStereo(Scan& scan, const StereoOptions& options) {
  scan.Run({"stereo", ValuesOf(options)}, [&](Progress& progress) -> nlohmann::json {
    EstimateMaps(scan.dense(), options, progress);
    const Workspace workspace = ChosenViews(ReadWorkspace(scan.dense()), options.views);
    nlohmann::json counts = {{"views", workspace.views.size()}};
    const auto poses = ReadRefinedPoses(scan.dense());
    if (const std::string refined = poses ? RefinedPosesWords(*poses) : ""; !refined.empty()) {
      counts["poses"]["refined"] = refined;
      progress.Warn(refined);
    }
    if (options.polarization) {
      counts["angles"] = CheckAngles(scan, workspace, options, progress);
      const std::string corrected =
          AnglesWereCorrected(workspace.correction, scan.state().OptionsOf("views"));
      if (!corrected.empty()) {
        counts["angles"]["corrected"] = corrected;
        progress.Warn(corrected);
      }
    }
    return counts;
  });
}

void RunFusion(Scan& scan, const FusionOptions& options) {
  scan.Run({"fusion", ValuesOf(options)}, [&](Progress& progress) -> nlohmann::json {
    fs::remove(scan.folder() / "offset.txt");  // of an earlier run
    const CloudSummary cloud = FuseCloud(scan.dense(), scan.cloud(), options, progress);
    scan.Note("cloud", "points", cloud.points);
    const nlohmann::json counts = ToJson(cloud);
    for (const std::string& doubt : Doubts(counts, options.min_views)) progress.Warn(doubt);
    return counts;
  });
}

void RunMesh(Scan& scan, const MeshOptions& options) {
  scan.Run({"mesh", ValuesOf(options)}, [&](Progress& progress) -> nlohmann::json {
    const MeshSummary mesh = MakeMesh(scan.cloud(), scan.dense(), scan.mesh(), options, progress);
    scan.Note("mesh", "faces", mesh.faces);
    return ToJson(mesh);
  });
}

bool MapsWereDamaged(const Scan& scan) {
  return scan.Counts("fusion").value("damaged", nlohmann::json(0)) > 0;
}

LengthUnit UnitOf(const Scan& scan) {
  const nlohmann::json& summary = scan.state().summary;
  LengthUnit unit;
  if (const auto found = summary.find("unit"); found != summary.end() && *found == "mm") unit.unit = "mm";
  if (const auto found = summary.find("unit_source"); found != summary.end() && found->is_string())
    unit.source = found->get<std::string>();
  if (const auto found = summary.find("unit_sigma"); found != summary.end() && found->is_number())
    unit.sigma = found->get<double>();
  return unit;
}

StereoOptions RecordedStereoOptions(const Scan& scan) {
  const nlohmann::json recorded = scan.state().OptionsOf("stereo");
  if (recorded.empty())
    throw Error("the scan does not say how its maps were made", (scan.folder() / "scan.json").string(),
                "Run polarscan stereo " + scan.folder().string());
  StereoOptions options;
  OptionTable table = Table(options);
  FromJson(recorded, table);
  return options;
}

}  // namespace polarscan
