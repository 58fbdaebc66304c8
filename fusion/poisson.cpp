// SPDX-License-Identifier: Apache-2.0
#include "fusion/poisson.h"

#include <fmt/format.h>
#include <tbb/parallel_sort.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/files.h"
#include "stereo/sfm/colmap.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

constexpr double kCube = 1.1;  // the reconstruction's cube, as a multiple of the cloud's longest side
constexpr int kFinest = 12;
constexpr std::size_t kPointsPerCell = 2;

Eigen::AlignedBox3f Box(std::span<const CloudPoint> cloud) {
  Eigen::AlignedBox3f box;
  for (const CloudPoint& p : cloud) box.extend(p.position);
  return box;
}

// Files that are not the user's: gone with the object.
struct Scratch {
  fs::path path;
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
};

}  // namespace

double PoissonCell(std::span<const CloudPoint> cloud, int depth) {
  return kCube * double(Box(cloud).sizes().maxCoeff()) / std::pow(2.0, depth);
}

std::size_t OccupiedCells(std::span<const CloudPoint> cloud, int depth) {
  const double cell = PoissonCell(cloud, depth);
  const Eigen::Vector3f corner = Box(cloud).min();
  std::vector<std::uint64_t> cells;
  cells.reserve(cloud.size());
  for (const CloudPoint& p : cloud) {
    const Eigen::Vector3d at = (p.position - corner).cast<double>() / cell;
    cells.push_back(std::uint64_t(at.x()) << 42 | std::uint64_t(at.y()) << 21 | std::uint64_t(at.z()));
  }
  tbb::parallel_sort(cells.begin(), cells.end());
  return std::size_t(std::unique(cells.begin(), cells.end()) - cells.begin());
}

int PoissonDepth(std::span<const CloudPoint> cloud) {
  for (int depth = kFinest; depth > kCoarsestDepth; --depth)
    if (kPointsPerCell * OccupiedCells(cloud, depth) <= cloud.size()) return depth;
  return kCoarsestDepth;
}

TriangleMesh PoissonSurface(std::span<const CloudPoint> cloud, int depth, const std::string& program,
                            const fs::path& folder, Progress& progress) {
  // COLMAP leaves files where it works; if it was killed, also its own temporary ones.
  const Scratch work{folder / "work"};
  fs::remove_all(work.path);
  CreateFolder(work.path);
  const fs::path log = folder / "colmap.log", points = work.path / "points.ply",
                 surface = work.path / "poisson.ply";
  WriteCloud(points, {cloud.begin(), cloud.end()});
  Colmap colmap(program, log, progress);
  colmap.Run("poisson_mesher",
             {{{"input_path"}, fs::absolute(points).string(), true},
              {{"output_path"}, fs::absolute(surface).string(), true},
              {{"PoissonMeshing.depth"}, std::to_string(depth), true},
              {{"PoissonMeshing.trim"}, "0", true},
              {{"PoissonMeshing.color"}, "0"},
              {{"PoissonMeshing.num_threads"}, "1", true}},
             "surface from the cloud", 0, "", work.path);
  std::string why = colmap.Complaint().empty() ? "no complaint" : colmap.Complaint();
  try {
    // COLMAP 3.8 makes a few vertices of some clouds that are no numbers.
    if (fs::exists(surface)) return ReadMesh(surface, NotFinite::kLeaveOut);
  } catch (const Error& error) {  // it ends with exit code 0 after an empty or half a mesh, too
    why = error.what();
  }
  throw Error(fmt::format("COLMAP made no surface of {} points ({})", cloud.size(), why), log.string(),
              "Look into that log; a smaller --mesh-depth needs less memory; --no-mesh (reconstruct) goes on "
              "without a mesh, --surfaces 0 (stereo) with separate maps");
}

}  // namespace polarscan
