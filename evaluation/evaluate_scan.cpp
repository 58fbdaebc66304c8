// SPDX-License-Identifier: Apache-2.0
#include "evaluation/evaluate_scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/error.h"
#include "core/files/files.h"
#include "core/formats/ply.h"
#include "core/shrink.h"
#include "core/statistics.h"
#include "evaluation/output/files.h"
#include "evaluation/output/pictures.h"
#include "evaluation/thresholds.h"
#include "fusion/cloud/cloud.h"
#include "pipeline/scan.h"
#include "stereo/sfm/alignment.h"

namespace polarscan {
namespace {

constexpr double kLeastSize = 0.05;  // of a scan beside its truth: more than a part of it would explain

namespace fs = std::filesystem;

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

// Mean errors; infinite where anything is missing.
Image<float> ShrinkErrors(const Image<float>& errors, int longest) {
  const auto [width, height] = FitSize(errors.width(), errors.height(), longest);
  return Shrink(errors, width, height, std::numeric_limits<float>::quiet_NaN(),
                [&](int x, int y) { return !std::isnan(errors(x, y)); });
}

// Where most of the points lie: the middle 90 % along each axis.
Eigen::AlignedBox3d MostOf(const std::vector<Eigen::Vector3d>& points) {
  Eigen::AlignedBox3d box;
  if (points.empty()) return box;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::ranges::transform(points, values.begin(), [axis](const Eigen::Vector3d& p) { return p[axis]; });
    box.min()[axis] = Quantile(values, 0.05), box.max()[axis] = Quantile(values, 0.95);
  }
  return box;
}

// With as many digits as tell the sides apart, also far from 0.
std::string Text(const Eigen::AlignedBox3d& box) {
  const Eigen::Vector3d &a = box.min(), &b = box.max();
  const double size = box.diagonal().norm();
  const int digits = size > 0 ? std::clamp(2 - int(std::floor(std::log10(size))), 0, 9) : 4;
  const auto range = [&](int axis) {
    return fmt::format("{:.{}f} to {:.{}f}", a[axis], digits, b[axis], digits);
  };
  return fmt::format("x {}, y {}, z {}", range(0), range(1), range(2));
}

// One run over one input.
class Evaluator {
 public:
  Evaluator(const EvaluateArguments& arguments, const Truth& truth, int picture_px, Progress& progress)
      : arguments_(arguments), truth_(truth), picture_px_(picture_px), progress_(progress) {
    const EvaluateOptions& o = arguments.options;
    const double unit = o.unit > 0 ? o.unit : ObjectUnit(truth.object());
    limits_ = {std::ranges::max(ParseThresholds(o.depth_thresholds, unit)),
               std::ranges::max(ParseThresholds(o.normal_thresholds_deg, 1))};
  }

  Evaluated Run(const fs::path& input) {
    if (!fs::is_directory(input)) {
      const auto cameras = arguments_.poses.empty() ? std::vector<DenseView>() : Cameras(TruePoses());
      const Similarity truth_from_cloud = FromFrameAt(ReadPlyOffset(input));
      std::vector<Eigen::Vector3d> points = ReadCloudPositions(input).points;
      for (Eigen::Vector3d& p : points) p = truth_from_cloud * p;
      CheckFrames(points, input, false);
      Cloud(input, truth_from_cloud, cameras);
    } else if (fs::exists(input / "dense/views.json")) {
      TellOutOfDate(input);
      if (arguments_.keep && arguments_.cloud.empty()) OpenFiles(input);
      Scan(input, input / "dense");
    } else if (fs::exists(input / "views.json")) {
      Scan(input, input);
    } else {
      throw Error("this folder holds no depth maps: neither dense/views.json nor views.json", input.string(),
                  "Give a scan that polarscan reconstruct made, a dense workspace, or a cloud as PLY");
    }
    done_.result.input = input.string();
    done_.result.truth = arguments_.truth.string();
    Keep([&] {
      files_->Finish(done_.result);
      done_.kept = EvaluationFolder(input);
    });
    return std::move(done_);
  }

 private:
  // Figures of maps and cloud that are not of each other.
  void TellOutOfDate(const fs::path& scan) {
    if (!fs::exists(scan / "scan.json")) return;
    const ScanState state = ReadScanState(scan / "scan.json");
    done_.result.maps_result = ResultOf(state, "stereo");
    for (const PlannedStage& stage : OutOfDateStages(state))
      if (stage.name == "stereo" || (stage.name == "fusion" && arguments_.cloud.empty()))
        progress_.Warn(fmt::format("the {} out of date: {}; polarscan {} {} makes {} anew",
                                   stage.name == "stereo" ? "maps are" : "cloud is", stage.why,
                                   stage.name == "stereo" ? "stereo" : "fuse", scan.string(),
                                   stage.name == "stereo" ? "them" : "it"));
  }

  // The truth's cameras, in its frame.
  SparseModel TruePoses() const {
    SparseModel model = ReadSparseModel(arguments_.poses);
    MoveOrigin(model, arguments_.truth_origin - model.offset);
    return model;
  }

  // From coordinates that count from `offset`, to those of the truth.
  Similarity FromFrameAt(const Eigen::Vector3d& offset) const {
    return {1, Eigen::Matrix3d::Identity(), offset - arguments_.truth_origin};
  }

  void OpenFiles(const fs::path& scan) {
    try {
      files_.emplace(scan);
    } catch (const std::exception& error) {
      progress_.Warn(fmt::format("the result is not kept in the scan: {}", error.what()));
    }
  }

  // What write() cannot leave in the scan is no reason to lose the figures.
  template <class Write>
  void Keep(Write&& write) {
    if (!files_) return;
    try {
      write();
    } catch (const Error& error) {
      progress_.Warn(fmt::format("the result is not kept in the scan: {}", error.what()));
      files_.reset();
    }
  }

  Alignment Align(const Workspace& workspace) const {
    try {
      return AlignCameras(Poses(workspace), Poses(TruePoses()));
    } catch (const Error& error) {
      throw Error(error.what(), arguments_.poses.string(),
                  "--no-align compares in the scan's own frame, without true poses");
    }
  }

  void Scan(const fs::path& input, const fs::path& dense) {
    const Workspace workspace = ReadWorkspace(dense);
    Similarity truth_from_scan = FromFrameAt(workspace.offset);
    if (arguments_.align && !arguments_.poses.empty()) {
      const Alignment alignment = Align(workspace);
      truth_from_scan = alignment.truth_from_scan;
      done_.result.alignment = alignment.errors;
    } else {
      progress_.Info("no true poses: the scan is compared in its own frame");
    }
    const fs::path cloud = arguments_.cloud.empty() ? input / "cloud.ply" : arguments_.cloud;
    const bool has_cloud = fs::exists(cloud) || !arguments_.cloud.empty();
    if (has_cloud) {
      std::vector<Eigen::Vector3d> points = ReadCloudPositions(cloud).points;
      for (Eigen::Vector3d& p : points) p = truth_from_scan * p;
      CheckFrames(points, input, done_.result.alignment.has_value());
    }
    if (arguments_.maps) Maps(workspace, truth_from_scan);
    if (has_cloud) Cloud(cloud, truth_from_scan, Moved(workspace.views, truth_from_scan));
  }

  // A box of the truth's frame in the coordinates of its file.
  std::string InFiles(const Eigen::AlignedBox3d& box) const {
    return Text({box.min() + arguments_.truth_origin, box.max() + arguments_.truth_origin});
  }

  // In frames or units that are not the truth's every figure would mean nothing. Surroundings count as truth.
  void CheckFrames(const std::vector<Eigen::Vector3d>& points, const fs::path& input, bool aligned) const {
    const Eigen::AlignedBox3d cloud = MostOf(points);
    Eigen::AlignedBox3d object, all;
    for (const Eigen::Vector3d& v : truth_.object().vertices) object.extend(v);
    for (const TriangleMesh& mesh : truth_.caster.meshes())
      for (const Eigen::Vector3d& v : mesh.vertices) all.extend(v);
    if (cloud.isEmpty()) return;
    const bool apart = !all.intersects(cloud);
    const double size = cloud.diagonal().norm() / object.diagonal().norm();
    if (!apart && size > kLeastSize && size < 1 / kLeastSize) return;
    const std::string what = apart ? "scan and truth do not overlap"
                                   : fmt::format("the scan is {:.3g} times as large as the truth", size);
    const std::string boxes =
        fmt::format("the scan's points lie in {}; the truth in {}", InFiles(cloud), InFiles(all));
    if (aligned) {
      progress_.Warn(fmt::format("{}, though its cameras were aligned to the true poses: {}", what, boxes));
      return;
    }
    throw Error(
        what + ", their frames or units are not the same: " + boxes, input.string(),
        arguments_.poses.empty()
            ? "Give the true poses of the pictures, as a COLMAP model in the truth's frame: --align "
              "--truth-poses SPARSE moves and scales the scan; or move the truth by hand (CloudCompare)"
            : "Use --align instead of --no-align: it moves and scales the scan by the true poses");
  }

  void Maps(const Workspace& workspace, const Similarity& truth_from_scan) {
    const auto sink = [&](const std::string& view, const ErrorMaps& errors) {
      Keep([&] { files_->AddView(view, errors, limits_); });
      if (picture_px_ <= 0) return;
      const auto picture = [&](const Image<float>& map, double limit) {
        return map.empty() ? Image<Rgb8>() : ErrorPicture(ShrinkErrors(map, picture_px_), limit);
      };
      done_.pictures.push_back(
          {view, picture(errors.depth, limits_.depth), picture(errors.normal_deg, limits_.normal_deg)});
    };
    done_.result.pictures = limits_;
    done_.result.maps = EvaluateMaps(workspace, truth_from_scan, truth_, arguments_.options, progress_, sink);
  }

  void Cloud(const fs::path& cloud, const Similarity& truth_from_scan,
             const std::vector<DenseView>& cameras) {
    CloudPositions positions = ReadCloudPositions(cloud);
    if (positions.not_finite > 0)
      progress_.Warn(fmt::format("{} points without a finite position are left out: {}", positions.not_finite,
                                 cloud.string()));
    for (Eigen::Vector3d& p : positions.points) p = truth_from_scan * p;
    const auto sink = [&](const std::vector<double>& errors) {
      if (positions.not_finite == 0) Keep([&] { files_->AddCloud(positions.points, errors); });
    };
    done_.result.cloud = EvaluateCloud(positions.points, cameras, truth_, arguments_.options, arguments_.seed,
                                       progress_, sink);
    done_.result.cloud_hash = ToHex(HashFile(cloud));
  }

  const EvaluateArguments& arguments_;
  const Truth& truth_;
  int picture_px_;
  Progress& progress_;
  ErrorLimits limits_;
  std::optional<EvaluationFiles> files_;
  Evaluated done_;
};

}  // namespace

Evaluated EvaluateInput(const fs::path& input, const EvaluateArguments& arguments, const Truth& truth,
                        int picture_px, Progress& progress) {
  return Evaluator(arguments, truth, picture_px, progress).Run(input);
}

}  // namespace polarscan
