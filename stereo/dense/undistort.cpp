// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/undistort.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/error.h"
#include "core/files/files.h"
#include "core/parallel.h"
#include "demosaic/stokes.h"
#include "stereo/dense/colmap/dense_export.h"
#include "stereo/dense/resample.h"
#include "stereo/dense/sources_and_depths.h"
#include "stereo/workspace.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

// One view's files, on both sides.
struct Task {
  std::string name;
  ColmapCamera camera;
  Resampling way;
  fs::path views;
};

Task MakeTask(const SparseModel& model, const ColmapImage& image, const fs::path& views, int max_size) {
  const std::string name = fs::path(image.name).stem().string();
  const ColmapCamera& camera = model.cameras.at(image.camera_id);
  return {name, camera, MakeResampling(ToLens(camera), max_size), views};
}

void CheckSize(const Task& task, int width, int height, const fs::path& path) {
  if (width == task.camera.width && height == task.camera.height) return;
  throw Error(fmt::format("the file has {} x {} pixels, its camera {} x {}", width, height, task.camera.width,
                          task.camera.height),
              path.string(), "Make views and poses again from the same pictures");
}

void CopyAtomically(const fs::path& from, const fs::path& to) {
  WriteAtomically(to, [&](const fs::path& temporary) {
    fs::copy_file(from, temporary, fs::copy_options::overwrite_existing);
  });
}

bool IsPolarized(const StokesImage& image) {
  const auto not_zero = [](float value) { return value != 0; };
  return std::ranges::any_of(image.s1.pixels(), not_zero) || std::ranges::any_of(image.s2.pixels(), not_zero);
}

// Returns whether the view is polarized.
bool UndistortStokes(const Task& task, const fs::path& to) {
  const fs::path from = task.views / (task.name + ".tif");
  const StokesImage image = ReadStokes(from);
  CheckSize(task, image.s0.width(), image.s0.height(), from);
  if (task.way.IsIdentity()) {
    CopyAtomically(from, to);
  } else {
    WriteStokes(to, Resample(image, task.way));
  }
  return IsPolarized(image);
}

std::uint8_t ToByte(float value) { return std::uint8_t(std::lround(std::clamp(value, 0.f, 255.f))); }

void WritePicture(const fs::path& path, const Picture& picture) {
  if (picture.planes.size() == 1) {
    Image<std::uint8_t> grey(picture.width(), picture.height());
    for (std::size_t i = 0; i < grey.size(); ++i) grey.pixels()[i] = ToByte(picture.planes[0].pixels()[i]);
    return WritePng(path, grey);
  }
  Image<Rgb8> colour(picture.width(), picture.height());
  for (std::size_t i = 0; i < colour.size(); ++i)
    colour.pixels()[i] = {ToByte(picture.planes[0].pixels()[i]), ToByte(picture.planes[1].pixels()[i]),
                          ToByte(picture.planes[2].pixels()[i])};
  WritePng(path, colour);
}

void UndistortPicture(const Task& task, const fs::path& to) {
  const fs::path from = task.views / (task.name + ".png");
  const Picture picture = ReadPicture(from);
  CheckSize(task, picture.width(), picture.height(), from);
  if (task.way.IsIdentity()) return CopyAtomically(from, to);
  if (picture.bits != 8) throw Error("an 8-bit picture was expected", from.string(), "Make the views again");
  WritePicture(to, Resample(picture, task.way));
}

// The undistorted mask, which is also written; empty if the view has none.
Image<std::uint8_t> UndistortMask(const Task& task, const fs::path& to) {
  const fs::path from = task.views / "masks" / (task.name + ".png");
  if (!fs::exists(from)) return {};
  Image<std::uint8_t> mask = ReadMask(from);
  CheckSize(task, mask.width(), mask.height(), from);
  if (!task.way.IsIdentity()) mask = Resample(mask, task.way);
  WritePng(to, mask);
  return mask;
}

// The workspace's views, sorted by name, without sources and depths.
Workspace PlanViews(const SparseModel& model, const fs::path& dense, const std::vector<Task>& tasks) {
  Workspace workspace{dense, {}, false, model.offset};
  std::map<std::string, const ColmapImage*> images;
  for (const auto& [id, image] : model.images) images[fs::path(image.name).stem().string()] = &image;
  for (const Task& task : tasks)
    workspace.views.push_back({task.name, task.way.camera, images.at(task.name)->cam_from_world, 0, 0, {}});
  return workspace;
}

void ClearFolder(const fs::path& dense) {
  fs::remove(dense / "views.json");
  for (const char* name : {"images", "polar", "masks", "sparse"}) fs::remove_all(dense / name);
}

void ApplyDepthOptions(const UndistortOptions& options, DenseView& view) {
  if (options.depth_min > 0) view.depth_min = options.depth_min;
  if (options.depth_max > 0) view.depth_max = options.depth_max;
  if (view.depth_max <= view.depth_min)
    throw Error(fmt::format("the depth range {} to {} is empty", view.depth_min, view.depth_max), view.name,
                "Check depth-min and depth-max; they are in the units of the poses");
}

// Finds or mends the masks, and the depth ranges that come of them. given: whether there are any.
MaskNotes SeeToMasks(const SparseModel& model, bool given, const UndistortOptions& options,
                     Workspace& workspace, Progress& progress) {
  MaskNotes notes;
  if (!options.masks) return notes;
  if (!given && options.find_masks) notes.found = FindMasks(model, workspace, progress);
  if (options.mend_masks) notes.mending = MendMasks(workspace, progress);
  if (notes.mending.Any()) SetDepthRanges(model, workspace, progress);
  return notes;
}

}  // namespace

OptionTable Table(UndistortOptions& o) {
  return {
      {"max-image-size", &o.max_image_size,
       "longer side of the pictures that stereo works on: half the size is four times as fast; 0: as they "
       "are",
       "px", 0, 100000},
      {"masks", &o.masks, "use the input's masks"},
      {"find-masks", &o.find_masks,
       "where no masks are given and the background is plain in all pictures, or stands still while the "
       "object turns, "
       "make masks of what differs from it"},
      {"mend-masks", &o.mend_masks,
       "move the outlines of masks that are too wide or too narrow as a whole, and mend pieces that one mask "
       "lacks "
       "or has alone"},
      {"depth-min", &o.depth_min,
       "nearest depth of the scene, in units of the poses; 0: from masks, points or cameras", "", 0, 1e12},
      {"depth-max", &o.depth_max, "farthest depth of the scene; 0: as depth-min", "", 0, 1e12},
  };
}

MaskNotes Undistort(const fs::path& views, const SparseModel& model, const fs::path& dense,
                    const UndistortOptions& options, Progress& progress) {
  std::vector<Task> tasks;
  for (const auto& [id, image] : model.images)
    tasks.push_back(MakeTask(model, image, views, options.max_image_size));
  std::ranges::sort(tasks, {}, &Task::name);
  Workspace workspace = PlanViews(model, dense, tasks);
  LeaveOutCopies(model, workspace, progress);
  std::erase_if(tasks, [&](const Task& task) {
    return !std::ranges::binary_search(workspace.views, task.name, {}, &DenseView::name);
  });
  ClearFolder(dense);

  std::vector<CoarseMask> masks(tasks.size());
  std::atomic<bool> polarized = false;
  progress.Begin("undistort", tasks.size());
  ParallelFor(0, int(tasks.size()), [&](int i) {
    progress.Check();
    const Task& task = tasks[std::size_t(i)];
    if (UndistortStokes(task, workspace.StokesPath(i))) polarized = true;
    UndistortPicture(task, workspace.PicturePath(i));
    if (options.masks) masks[std::size_t(i)] = Coarsen(UndistortMask(task, workspace.MaskPath(i)));
    progress.Advance();
  });
  workspace.polarized = polarized;

  SetDepthRanges(model, masks, workspace, progress);
  const bool given = std::ranges::any_of(masks, [](const CoarseMask& mask) { return !mask.cells.empty(); });
  const MaskNotes notes = SeeToMasks(model, given, options, workspace, progress);
  ChooseSources(model, workspace, progress);
  for (DenseView& view : workspace.views) ApplyDepthOptions(options, view);
  WriteColmapWorkspace(workspace, model);
  WriteWorkspace(workspace);
  return notes;
}

}  // namespace polarscan
