// SPDX-License-Identifier: Apache-2.0
#include "report/scene/views.h"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include <optional>

#include "core/error.h"
#include "core/parallel.h"
#include "core/statistics.h"
#include "demosaic/false_colour.h"
#include "evaluation/output/files.h"
#include "report/pictures.h"
#include "stereo/workspace.h"

namespace fs = std::filesystem;

namespace polarscan {
namespace {

constexpr int kLongestSide = 320, kViewsAtFullSize = 80, kMostPictured = 1200;

nlohmann::json CameraToPage(const DenseView& view, const Eigen::Matrix3d& display_from_world) {
  const Eigen::Matrix3d display_from_cam = display_from_world * view.cam_from_world.rotation.transpose();
  const Eigen::Vector3d center = display_from_world * view.cam_from_world.Center();
  nlohmann::json corners = nlohmann::json::array();
  const double w = view.camera.width, h = view.camera.height;
  for (const auto& [u, v] : {std::pair{0., 0.}, {w, 0.}, {w, h}, {0., h}}) {
    const Eigen::Vector3d ray = display_from_cam * view.camera.Ray(u, v);
    corners.push_back({ray.x(), ray.y(), ray.z()});
  }
  return {{"center", {center.x(), center.y(), center.z()}}, {"corners", corners}};
}

// Up is the mean of the cameras' up; towards the viewer is where the cameras stand, or the first one if all
// round.
Eigen::Matrix3d DisplayFrame(const std::vector<DenseView>& views) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero(), back = Eigen::Vector3d::Zero();
  for (const DenseView& view : views) {
    up -= view.cam_from_world.rotation.row(1).transpose();
    back -= view.cam_from_world.rotation.row(2).transpose();
  }
  if (views.empty() || up.norm() < 1e-3 * double(views.size())) return Eigen::Matrix3d::Identity();
  up.normalize();
  const auto horizontal = [&](const Eigen::Vector3d& v) -> Eigen::Vector3d { return v - v.dot(up) * up; };
  Eigen::Vector3d front = horizontal(back / double(views.size()));
  if (front.norm() < 0.3) front = horizontal(-views[0].cam_from_world.rotation.row(2).transpose());
  if (front.norm() < 1e-3) front = horizontal(views[0].cam_from_world.rotation.row(0).transpose());
  front.normalize();
  Eigen::Matrix3d display_from_world;
  display_from_world << up.cross(front).transpose(), up.transpose(), front.transpose();
  return display_from_world;
}

std::vector<Thumbnails> ListDense(const Workspace& workspace, const fs::path& evaluation) {
  std::vector<Thumbnails> views;
  for (int i = 0; i < int(workspace.views.size()); ++i) {
    const auto best = [&](auto path) {
      return fs::exists(path(kFinalMaps)) ? path(kFinalMaps) : path(kPhotometricMaps);
    };
    Thumbnails view;
    view.name = workspace.views[std::size_t(i)].name;
    view.stokes_path = workspace.StokesPath(i);
    view.picture_path = workspace.PicturePath(i);
    view.depth_path = best([&](const MapKind& kind) { return workspace.DepthPath(i, kind); });
    view.mask_path = workspace.MaskPath(i);
    view.normal_path = best([&](const MapKind& kind) { return workspace.NormalPath(i, kind); });
    view.depth_error_path = DepthErrorPath(evaluation, view.name);
    view.normal_error_path = NormalErrorPath(evaluation, view.name);
    views.push_back(view);
  }
  return views;
}

std::vector<Thumbnails> ListViews(const fs::path& folder) {
  std::vector<Thumbnails> views;
  if (!fs::is_directory(folder)) return views;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".tif") continue;
    Thumbnails view;
    view.name = entry.path().stem().string();
    view.stokes_path = entry.path();
    view.picture_path = fs::path(entry.path()).replace_extension(".png");
    views.push_back(view);
  }
  std::sort(views.begin(), views.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return views;
}

std::optional<Workspace> TryReadWorkspace(const fs::path& dense, std::vector<std::string>& notes) {
  if (!fs::exists(dense / "views.json")) return std::nullopt;
  try {
    return ReadWorkspace(dense);
  } catch (const Error& error) {
    notes.push_back(error.what());
    return std::nullopt;
  }
}

void NoteMissing(const std::vector<Thumbnails>& views, ReportPictures& report) {
  const auto note = [&](const std::string& what, auto has) {
    const auto count = std::size_t(std::count_if(views.begin(), views.end(), has));
    if (count == 0) report.notes.push_back(fmt::format("There are no {} yet.", what));
    if (count > 0 && count < views.size())
      report.notes.push_back(fmt::format("Only {} of {} views have {}.", count, views.size(), what));
  };
  note("depth maps", [](const Thumbnails& view) { return !view.depth.empty(); });
  note("normal maps", [](const Thumbnails& view) { return !view.normal.empty(); });
  for (const Thumbnails& view : views)
    report.notes.insert(report.notes.end(), view.damaged.begin(), view.damaged.end());
}

// Reads the views' pictures: all of them, smaller ones for more views, and beyond kMostPictured every n-th.
void ReadPictures(std::vector<Thumbnails>& views, ReportPictures& report, Progress& progress) {
  const std::size_t step = (views.size() + kMostPictured - 1) / kMostPictured;
  if (step > 1) report.notes.push_back(fmt::format("Only every {}th view has pictures on this page.", step));
  const double pictured = double(views.size()) / double(std::max<std::size_t>(step, 1));
  const int longest =
      int(kLongestSide * std::min(1.0, std::sqrt(kViewsAtFullSize / std::max(pictured, 1.0))));
  progress.Begin("report", views.size());
  ParallelFor(0, int(views.size()), [&](int i) {
    progress.Check();
    if (std::size_t(i) % step == 0) ReadSmall(views[std::size_t(i)], longest);
    progress.Advance();
  });
  std::vector<double> dop, noise;
  for (const Thumbnails& view : views) {
    if (!view.stokes) continue;
    AppendDop(*view.stokes, dop);
    noise.push_back(view.dop_noise);
  }
  report.dop_noise = Quantile(noise, 0.5);
  if (Quantile(dop, 0.98) > 0) report.dop_full = DopFullScale(dop);
}

}  // namespace

ReportPictures CollectViews(const fs::path& scan_folder, Progress& progress) {
  ReportPictures report;
  const std::optional<Workspace> workspace = TryReadWorkspace(scan_folder / "dense", report.notes);
  std::vector<Thumbnails> views =
      workspace ? ListDense(*workspace, EvaluationFolder(scan_folder)) : ListViews(scan_folder / "views");
  if (workspace) report.display_from_world = DisplayFrame(workspace->views);
  if (!workspace) report.notes.push_back("The cameras' places are not known yet: no dense workspace.");
  if (views.empty()) report.notes.push_back("There are no views yet.");

  ReadPictures(views, report, progress);

  if (!views.empty()) NoteMissing(views, report);
  for (std::size_t i = 0; i < views.size(); ++i) {
    nlohmann::json page = ToPage(views[i], report.dop_full);
    if (workspace) {
      const DenseView& view = workspace->views[i];
      page["camera"] = CameraToPage(view, report.display_from_world);
      for (int source : view.sources)
        page["source_names"].push_back(workspace->views.at(std::size_t(source)).name);
    }
    report.views.push_back(page);
  }
  return report;
}

}  // namespace polarscan
