// SPDX-License-Identifier: Apache-2.0
// fusion_scale FOLDER VIEWS WIDTH HEIGHT [surface|stereo]: writes a workspace of that many views of a ball,
// from all around and filling the picture's height, if the folder holds none; else fuses it or, with
// `surface`, does the last step of stereo with it, with `stereo` the steps before for the first 25 views (as
// many as one round holds), both with --cache 1; prints points, seconds and the peak memory of the
// process.
#include <fmt/format.h>
#include <sys/resource.h>

#include <chrono>
#include <cstdlib>
#include <numbers>

#include "core/parallel.h"
#include "fusion/cloud/fuse.h"
#include "pipeline/stereo/done_list.h"
#include "pipeline/stereo/stage_inputs.h"
#include "pipeline/stereo/stereo.h"
#include "stereo/dense/crop.h"
#include "tests/fusion/sphere_scene.h"

using namespace polarscan;

namespace {

// The twelve cameras nearest to this view's.
std::vector<int> NearestViews(const Workspace& workspace, const DenseView& view) {
  const auto distance = [&](int other) {
    return (workspace.views[std::size_t(other)].cam_from_world.Center() - view.cam_from_world.Center())
        .norm();
  };
  std::vector<int> nearest;
  for (int other = 0; other < int(workspace.views.size()); ++other)
    if (distance(other) > 0) nearest.push_back(other);
  std::ranges::sort(nearest, {}, distance);
  nearest.resize(std::min(nearest.size(), std::size_t(12)));
  return nearest;
}

// On a spiral of even density around the ball, radius 4, which fills 0.9 of the height.
Workspace BallWorkspace(const std::filesystem::path& folder, int views, int width, int height) {
  Workspace workspace{folder, {}, true};
  const double focal = 0.45 * height * std::sqrt(15.);  // tan of the ball's angle: 1 / sqrt(4^2 - 1)
  for (int i = 0; i < views; ++i) {
    const double z = 1 - (2 * i + 1.) / views, turn = i * std::numbers::pi * (3 - std::sqrt(5.));
    const double r = std::sqrt(1 - z * z);
    DenseView view{fmt::format("v{:04}", i),
                   {width, height, focal, focal, width / 2., height / 2.},
                   LookAtOrigin(4 * Eigen::Vector3d(r * std::cos(turn), z, r * std::sin(turn))),
                   2.5,
                   6,
                   {}};
    workspace.views.push_back(view);
  }
  for (DenseView& view : workspace.views) view.sources = NearestViews(workspace, view);
  return workspace;
}

double PeakGb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return double(usage.ru_maxrss) * 1024 / 1e9;
}

// As if the maps had just been estimated.
void DrawSurface(const std::filesystem::path& folder, const StereoOptions& options, Progress& progress) {
  const Workspace workspace = CutToObject(ReadWorkspace(folder), options);
  DoneList done(workspace, StereoInputHash(workspace, options));
  for (int view = 0; view < int(workspace.views.size()); ++view) {
    WriteMaps(workspace, view, kSeparateMaps, ReadMaps(workspace, view, kFinalMaps));
    done.Add(view, kSeparateMaps);
  }
  EstimateMaps(folder, options, progress);
}

constexpr int kNeighbours = 25;  // a round's own view and its voters

}  // namespace

int main(int argc, char** argv) {
  const std::string step = argc == 6 ? argv[5] : "fusion";
  if (argc < 5 || (step != "fusion" && step != "surface" && step != "stereo")) {
    fmt::print(stderr, "usage: fusion_scale FOLDER VIEWS WIDTH HEIGHT [surface|stereo]\n");
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  const int views = std::atoi(argv[2]), width = std::atoi(argv[3]), height = std::atoi(argv[4]);
  if (!std::filesystem::exists(folder / "views.json")) {
    const Workspace workspace = BallWorkspace(folder, views, width, height);
    WriteSphere(workspace);
    WriteSphereMasks(workspace);
    fmt::print("written; run again to measure\n");  // so that the peak is fusion's alone
    return 0;
  }
  const auto begin = std::chrono::steady_clock::now();
  Progress progress;
  const auto seconds = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  if (step != "fusion") {
    StereoOptions options;
    options.cache_gb = 1;
    if (step == "surface") {
      DrawSurface(folder, options, progress);
    } else {
      options.surfaces = 0;
      const Workspace workspace = ReadWorkspace(folder);
      for (int view = 0; view < std::min(views, kNeighbours); ++view)
        options.views += (view ? "," : "") + workspace.views[std::size_t(view)].name;
      EstimateMaps(folder, options, progress);
    }
    fmt::print("{} of {} views of {:.2f} MP: {:.0f} s, peak {:.2f} GB\n", step, views, width * height / 1e6,
               seconds(), PeakGb());
    return 0;
  }
  const CloudSummary cloud = FuseCloud(folder, folder / "cloud.ply", {}, progress);
  fmt::print("{} views of {:.2f} MP: {} points from {} pixels, {:.0f} s, peak {:.2f} GB\n", cloud.views,
             width * height / 1e6, cloud.points, cloud.counts.with_depth, seconds(), PeakGb());
}
