// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/hull_votes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/parallel.h"
#include "stereo/dense/masks/object_box.h"

namespace polarscan {
namespace {

constexpr int kCubes = 128;
constexpr std::size_t kFewestMasks = 16;  // masks that can outvote one
constexpr int kMistaken = 20;             // one mask in so many may be wrong about a place, at least one

// A mask at a coarser size.
struct SmallMask {
  int view = 0;
  double scale = 1;  // px of the mask to px of this
  Image<std::uint8_t> pixels;
};

// Half or more of a small pixel's pixels.
Image<std::uint8_t> Shrunk(const Image<std::uint8_t>& mask, double scale) {
  const int width = std::max(1, int(std::ceil(mask.width() * scale))),
            height = std::max(1, int(std::ceil(mask.height() * scale)));
  Image<int> balance(width, height, 0);
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x) balance(int(x * scale), int(y * scale)) += mask(x, y) ? 1 : -1;
  Image<std::uint8_t> small(width, height);
  for (std::size_t i = 0; i < small.size(); ++i) small.pixels()[i] = balance.pixels()[i] >= 0 ? 255 : 0;
  return small;
}

// Cubes of a box, and of each how many masks have its middle in their picture and outside of the object.
class CubeVotes {
 public:
  CubeVotes(const ObjectBox& box, const std::vector<DenseView>& views, const MaskOf& read,
            const std::vector<int>& masked)
      : low_(box.low), side_((box.high - box.low).maxCoeff() / kCubes), views_(views) {
    for (int axis = 0; axis < 3; ++axis)
      count_[axis] = std::max(1, int(std::ceil((box.high[axis] - box.low[axis]) / side_)));
    const Eigen::Vector3d middle = (box.low + box.high) / 2;
    for (const int view : masked) {
      const DenseView& v = views[std::size_t(view)];
      const double depth = std::max((v.cam_from_world * middle).z(), v.depth_min);
      const double scale = std::min(1.0, depth / (v.camera.fx * side_));
      small_.push_back({view, scale, Shrunk(read(view), scale)});
    }
  }

  void Count(Progress& progress) {
    excluders_.resize(std::size_t(count_[0]) * std::size_t(count_[1]) * std::size_t(count_[2]));
    judges_.resize(excluders_.size());
    ParallelFor(0, count_[2], [&](int z) {
      progress.Check();
      for (int y = 0; y < count_[1]; ++y)
        for (int x = 0; x < count_[0]; ++x)
          for (const SmallMask& mask : small_) {
            const auto says = Says(mask, Middle(x, y, z));
            const std::size_t cube = Index(x, y, z);
            judges_[cube] += says.has_value(), excluders_[cube] += says && !*says;
          }
    });
  }

  HullVote Of(const SmallMask& mask) const {
    HullVote vote{mask.pixels, mask.scale, Image<std::uint8_t>(mask.pixels.width(), mask.pixels.height())};
    for (int z = 0; z < count_[2]; ++z)
      for (int y = 0; y < count_[1]; ++y)
        for (int x = 0; x < count_[0]; ++x)
          if (const auto at = Place(mask, Middle(x, y, z)); at && Holds(Index(x, y, z), *at, mask))
            Mark(*at, vote.others);
    return vote;
  }

  const std::vector<SmallMask>& masks() const { return small_; }

 private:
  std::size_t Index(int x, int y, int z) const {
    return (std::size_t(z) * std::size_t(count_[1]) + std::size_t(y)) * std::size_t(count_[0]) +
           std::size_t(x);
  }
  Eigen::Vector3d Middle(int x, int y, int z) const {
    return low_ + side_ * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5);
  }

  // In px of the small mask; none: not in the picture.
  std::optional<Eigen::Vector2d> Place(const SmallMask& mask, const Eigen::Vector3d& world) const {
    const DenseView& view = views_[std::size_t(mask.view)];
    const Eigen::Vector3d p = view.cam_from_world * world;
    if (!view.camera.Sees(p)) return {};
    return mask.scale * view.camera.Project(p);
  }
  std::optional<bool> Says(const SmallMask& mask, const Eigen::Vector3d& world) const {
    const auto at = Place(mask, world);
    if (!at) return {};
    return mask.pixels(int(at->x()), int(at->y())) != 0;
  }
  // Whether the other masks hold the cube, which shows at `at` in this one, to be in the object.
  bool Holds(std::size_t cube, const Eigen::Vector2d& at, const SmallMask& mask) const {
    const bool excluded_here = mask.pixels(int(at.x()), int(at.y())) == 0;
    const int judges = judges_[cube] - 1, excluders = excluders_[cube] - excluded_here;
    return judges >= int(kFewestMasks) - 1 && excluders <= std::max(1, judges / kMistaken);
  }
  // A cube is about a pixel wide: that around `at`.
  static void Mark(const Eigen::Vector2d& at, Image<std::uint8_t>& hull) {
    for (const double dy : {-0.5, 0.5})
      for (const double dx : {-0.5, 0.5}) {
        const int x = int(at.x() + dx), y = int(at.y() + dy);
        if (hull.Contains(x, y)) hull(x, y) = 255;
      }
  }

  Eigen::Vector3d low_;
  double side_;
  std::array<int, 3> count_{};
  const std::vector<DenseView>& views_;
  std::vector<SmallMask> small_;
  std::vector<std::uint16_t> excluders_, judges_;
};

}  // namespace

std::vector<HullVote> HullVotes(const std::vector<DenseView>& views, const MaskOf& mask, Progress& progress) {
  std::vector<HullVote> votes(views.size());
  const auto [masked, box] = BoxOfMasks(views, mask, progress);
  if (masked.size() < kFewestMasks || !box) return votes;
  CubeVotes cubes(*box, views, mask, masked);
  cubes.Count(progress);
  ParallelFor(0, int(masked.size()), [&](int i) {
    progress.Check();
    votes[std::size_t(masked[std::size_t(i)])] = cubes.Of(cubes.masks()[std::size_t(i)]);
  });
  return votes;
}

}  // namespace polarscan
