// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/mask_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/words.h"
#include "stereo/costs/stereo_view.h"

namespace polarscan {
namespace {

constexpr std::size_t kMostViews = 40;
constexpr int kMostPixels = 400, kLongestPicture = 400, kDepthSteps = 128;
constexpr int kExcluders = 2;       // one bad mask spoils none of the others
constexpr std::size_t kFewest = 4;  // masks that can tell
constexpr double kMuch = 0.2, kMostOfThem = 0.4;

// A mask, small and widened by a pixel, and where it was seen from.
struct Outline {
  std::string name;
  Pinhole camera;
  Rigid cam_from_world;
  double depth_min = 0, depth_max = 0;
  Image<std::uint8_t> mask;
  bool whole = false;  // the object does not touch the picture's border

  // Whether the object cannot be at a place of the world.
  bool Excludes(const Eigen::Vector3d& place) const {
    const Eigen::Vector3d p = cam_from_world * place;
    if (p.z() <= 0) return false;
    const Eigen::Vector2d at = camera.Project(p);
    const int x = int(std::floor(at.x())), y = int(std::floor(at.y()));
    return mask.Contains(x, y) ? mask(x, y) == 0 : whole;
  }
};

Image<std::uint8_t> Small(const Image<std::uint8_t>& mask, int width, int height) {
  Image<std::uint8_t> small(width, height);
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x) {
      if (!mask(x, y)) continue;
      const int u = int(std::int64_t(x) * width / mask.width()),
                v = int(std::int64_t(y) * height / mask.height());
      for (int dv = -1; dv <= 1; ++dv)
        for (int du = -1; du <= 1; ++du)
          if (small.Contains(u + du, v + dv)) small(u + du, v + dv) = 255;
    }
  return small;
}

std::vector<Outline> Outlines(const Workspace& workspace, Progress& progress) {
  std::vector<int> masked;
  for (int i = 0; i < int(workspace.views.size()); ++i)
    if (std::filesystem::exists(workspace.MaskPath(i))) masked.push_back(i);
  const std::size_t count = std::min(masked.size(), kMostViews);
  if (count < kFewest) return {};
  std::vector<Outline> outlines(count);
  ParallelFor(0, int(count), [&](int k) {
    progress.Check();
    const int index = masked[std::size_t(k) * masked.size() / count];
    const DenseView& view = workspace.views[std::size_t(index)];
    const double scale =
        std::min(1.0, double(kLongestPicture) / std::max(view.camera.width, view.camera.height));
    const int width = std::max(1, int(view.camera.width * scale)),
              height = std::max(1, int(view.camera.height * scale));
    Outline& outline = outlines[std::size_t(k)];
    outline = {view.name,
               view.camera.Resized(width, height),
               view.cam_from_world,
               view.depth_min,
               view.depth_max,
               Small(ReadViewMask(workspace, index), width, height),
               false};
    outline.whole = KeepsClearOfBorder(outline.mask);
  });
  return outlines;
}

bool IsLost(const Outline& from, int x, int y, const std::vector<Outline>& all) {
  const Rigid world_from_cam = from.cam_from_world.Inverse();
  const Eigen::Vector3d ray = from.camera.Ray(x + 0.5, y + 0.5);
  for (int step = 0; step < kDepthSteps; ++step) {
    const double depth = from.depth_min + (step + 0.5) / kDepthSteps * (from.depth_max - from.depth_min);
    const Eigen::Vector3d place = world_from_cam * Eigen::Vector3d(depth * ray);
    int excluders = 0;
    for (const Outline& other : all)
      if (&other != &from && other.Excludes(place) && ++excluders == kExcluders) break;
    if (excluders < kExcluders) return false;
  }
  return true;
}

double LostShare(const Outline& from, const std::vector<Outline>& all, Random random) {
  std::vector<int> pixels;
  for (int i = 0; i < int(from.mask.size()); ++i)
    if (from.mask.pixels()[std::size_t(i)]) pixels.push_back(i);
  if (pixels.empty()) return 0;
  int lost = 0;
  for (int i = 0; i < kMostPixels; ++i) {
    const int pixel = pixels[random.Below(std::uint32_t(pixels.size()))];
    lost += IsLost(from, pixel % from.mask.width(), pixel / from.mask.width(), all);
  }
  return double(lost) / kMostPixels;
}

}  // namespace

std::map<std::string, double> MasksThatDoNotFit(const Workspace& workspace, Progress& progress) {
  const std::vector<Outline> outlines = Outlines(workspace, progress);
  std::vector<double> lost(outlines.size());
  ParallelFor(0, int(outlines.size()), [&](int i) {
    progress.Check();
    lost[std::size_t(i)] = LostShare(outlines[std::size_t(i)], outlines, Random(1, std::uint64_t(i)));
  });
  std::map<std::string, double> of_view;
  for (std::size_t i = 0; i < outlines.size(); ++i) of_view[outlines[i].name] = lost[i];
  return of_view;
}

std::string MaskFitWords(const std::map<std::string, double>& lost) {
  std::vector<std::string> bad;
  double mean = 0;
  for (const auto& [name, share] : lost) {
    mean += share / double(lost.size());
    if (share > kMuch) bad.push_back(name);
  }
  if (bad.empty()) return "";
  if (double(bad.size()) > kMostOfThem * double(lost.size()))
    return fmt::format(
        "masks and poses do not fit each other: {:.0f} % of the masks' pixels see no place that the other "
        "masks allow. Are the poses, the focal length or the masks of other pictures, or the poses written "
        "by another convention?",
        100 * mean);
  return fmt::format(
      "the mask{} of {} do{} not fit the others: inverted, turned, of another view, or is the pose another "
      "view's?",
      bad.size() == 1 ? "" : "s", Enumerate(bad), bad.size() == 1 ? "es" : "");
}

}  // namespace polarscan
