// SPDX-License-Identifier: Apache-2.0
// fusion_scale FOLDER VIEWS WIDTH HEIGHT [surface]: writes a workspace of that many views of a ball, from all
// around and filling the picture's height, if the folder holds none; else fuses it or, with `surface`, does
// the last step of stereo with it (--cache 1); prints points, seconds and the peak memory of the process and
// of COLMAP.
#include <fmt/format.h>
#include <sys/resource.h>

#include <chrono>
#include <cstdlib>
#include <numbers>

#include "core/parallel.h"
#include "fusion/fuse.h"
#include "fusion/surface_maps.h"
#include "stereo/polarpms/crop.h"
#include "stereo/polarpms/done_list.h"
#include "stereo/polarpms/stage_inputs.h"
#include "tests/fusion/sphere_scene.h"

using namespace polarscan;

namespace {

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
                   {(i + 1) % views}};
    workspace.views.push_back(view);
  }
  return workspace;
}

double PeakGb(int who = RUSAGE_SELF) {
  rusage usage{};
  getrusage(who, &usage);
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

}  // namespace

int main(int argc, char** argv) {
  const bool surface = argc == 6 && std::string(argv[5]) == "surface";
  if (argc != 5 && !surface) {
    fmt::print(stderr, "usage: fusion_scale FOLDER VIEWS WIDTH HEIGHT [surface]\n");
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
  if (surface) {
    StereoOptions options;
    options.cache_gb = 1;
    DrawSurface(folder, options, progress);
    fmt::print("{} views of {:.2f} MP: {:.0f} s, peak {:.2f} GB, COLMAP {:.2f} GB\n", views,
               width * height / 1e6, seconds(), PeakGb(), PeakGb(RUSAGE_CHILDREN));
    return 0;
  }
  const CloudSummary cloud = FuseCloud(folder, folder / "cloud.ply", {}, progress);
  fmt::print("{} views of {:.2f} MP: {} points from {} pixels, {:.0f} s, peak {:.2f} GB\n", cloud.views,
             width * height / 1e6, cloud.points, cloud.counts.with_depth, seconds(), PeakGb());
}
