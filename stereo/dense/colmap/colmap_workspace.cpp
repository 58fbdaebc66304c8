// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/colmap/colmap_workspace.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "stereo/dense/sources_and_depths.h"
#include "stereo/sfm/model/model.h"
#include "stereo/sfm/scene_points.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

fs::path ModelFolder(const fs::path& folder) {
  const fs::path sparse = folder / "sparse";
  const bool here = fs::exists(sparse / "cameras.bin") || fs::exists(sparse / "cameras.txt");
  return here || !fs::is_directory(sparse / "0") ? sparse : sparse / "0";
}

DenseView MakeView(const fs::path& folder, const SparseModel& model, const ColmapImage& image) {
  if (!fs::exists(folder / "images" / image.name))
    throw Error("the model's picture is not there", (folder / "images" / image.name).string(),
                "Make the workspace again with colmap image_undistorter");
  DenseView view;
  view.name = ViewName(image.name), view.picture = image.name;
  view.camera = ToPinhole(model.cameras.at(image.camera_id));
  view.cam_from_world = image.cam_from_world;
  return view;
}

void RequireDifferentNames(const Workspace& workspace) {
  for (std::size_t i = 1; i < workspace.views.size(); ++i)
    if (workspace.views[i].name == workspace.views[i - 1].name)
      throw Error(fmt::format("the pictures {} and {} differ in their extension only",
                              workspace.views[i - 1].picture, workspace.views[i].picture),
                  (workspace.folder / "images").string(), "Rename one of them");
}

}  // namespace

bool IsColmapWorkspace(const fs::path& folder) {
  return fs::is_directory(folder / "images") && fs::is_directory(folder / "sparse") &&
         !fs::exists(folder / "polar") && !fs::exists(folder / "scan.json");
}

void AdoptColmapWorkspace(const fs::path& folder, Progress& progress) {
  SparseModel model = ReadSparseModel(ModelFolder(folder));
  MoveToLocalFrame(model, progress);
  Workspace workspace{folder, {}, false, model.offset};
  for (const auto& [id, image] : model.images) workspace.views.push_back(MakeView(folder, model, image));
  std::ranges::sort(workspace.views, {}, &DenseView::name);
  RequireDifferentNames(workspace);
  LeaveOutCopies(model, workspace, progress);
  std::vector<CoarseMask> masks;
  for (int i = 0; i < int(workspace.views.size()); ++i) {
    progress.Check();
    masks.push_back(Coarsen(ReadViewMask(workspace, i)));
  }
  SetDepthRanges(model, masks, workspace, progress);
  ChooseSources(model, workspace, progress);
  WriteWorkspace(workspace);
}

}  // namespace polarscan
