// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/finding/still_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/parallel.h"

namespace polarscan {
namespace {

constexpr int kTextureSize = 160;    // px, of the pictures that are compared
constexpr int kTiles = 8;            // a side
constexpr double kFine = 3;          // px: what is coarser is light on a wall, and moves little with a camera
constexpr double kAlikeTiles = 0.8;  // correlation
constexpr double kStillTiles = 0.5;  // of the border's tiles with texture
constexpr int kLeastTiles = 4;
constexpr double kTextured = 0.25;  // of the strongest texture of a tile
constexpr std::size_t kLeastGroup = 8, kComparedFirst = 6;

using Texture = cv::Mat_<float>;

// The fine texture of a view's S0, small.
Texture FineTexture(const Workspace& workspace, int view) {
  const StokesImage light = ReadViewLight(workspace, view);
  const cv::Mat s0(light.s0.height(), light.s0.width(), CV_32F, const_cast<float*>(light.s0.row(0)));
  const double scale = std::min(1.0, double(kTextureSize) / std::max(s0.cols, s0.rows));
  Texture small, coarse;
  cv::resize(s0, small, {}, scale, scale, cv::INTER_AREA);
  cv::GaussianBlur(small, coarse, {}, kFine);
  return small - coarse;
}

bool IsAtBorder(int tile) {
  const int column = tile % kTiles, row = tile / kTiles;
  return column == 0 || row == 0 || column == kTiles - 1 || row == kTiles - 1;
}

bool ShowOneBackground(const Texture& a, const Texture& b) {
  if (a.size() != b.size()) return false;
  const int width = a.cols / kTiles, height = a.rows / kTiles;
  std::vector<std::array<double, 3>> products;  // of the border's tiles: a a, b b, a b
  double strongest_a = 0, strongest_b = 0;
  for (int k = 0; k < kTiles * kTiles; ++k) {
    if (!IsAtBorder(k)) continue;
    const cv::Rect tile(k % kTiles * width, k / kTiles * height, width, height);
    products.push_back({a(tile).dot(a(tile)), b(tile).dot(b(tile)), a(tile).dot(b(tile))});
    strongest_a = std::max(strongest_a, products.back()[0]),
    strongest_b = std::max(strongest_b, products.back()[1]);
  }
  constexpr double kLeastSquare = kTextured * kTextured;
  int textured = 0, alike = 0;
  for (const auto& [aa, bb, ab] : products) {
    if (!(aa > kLeastSquare * strongest_a && bb > kLeastSquare * strongest_b)) continue;
    ++textured;
    alike += ab > kAlikeTiles * std::sqrt(aa * bb);
  }
  return alike >= kLeastTiles && alike >= kStillTiles * textured;
}

bool SameCamera(const Pinhole& a, const Pinhole& b) {
  return a.width == b.width && a.height == b.height && (a.K() - b.K()).cwiseAbs().maxCoeff() < 1e-3;
}

// Each view joins the first group whose first view shows the same.
std::vector<std::vector<int>> GroupViews(const Workspace& workspace, const std::vector<int>& views,
                                         Progress& progress) {
  std::vector<Texture> textures(views.size());
  ParallelFor(0, int(views.size()), [&](int k) {
    progress.Check();
    textures[std::size_t(k)] = FineTexture(workspace, views[std::size_t(k)]);
  });
  std::vector<std::vector<int>> groups;  // of places in `views`
  for (int k = 0; k < int(views.size()); ++k) {
    const auto camera = [&](int of) -> const Pinhole& {
      return workspace.views[std::size_t(views[std::size_t(of)])].camera;
    };
    const auto group = std::ranges::find_if(groups, [&](const std::vector<int>& of) {
      return SameCamera(camera(of[0]), camera(k)) &&
             ShowOneBackground(textures[std::size_t(of[0])], textures[std::size_t(k)]);
    });
    if (group != groups.end())
      group->push_back(k);
    else
      groups.push_back({k});
  }
  for (auto& group : groups)
    for (int& k : group) k = views[std::size_t(k)];
  return groups;
}

// Neighbours and views far apart.
std::vector<int> FirstAsked(std::size_t count) {
  std::vector<int> views;
  for (std::size_t k = 0; k < kComparedFirst; ++k)
    views.push_back(int(k * (count - 1) / (kComparedFirst - 1)));
  return views;
}

}  // namespace

std::vector<std::vector<int>> GroupsBeforeOneBackground(const Workspace& workspace, Progress& progress) {
  const std::size_t count = workspace.views.size();
  if (count < kLeastGroup) return {};
  if (GroupViews(workspace, FirstAsked(count), progress).size() == kComparedFirst) return {};
  std::vector<int> all(count);
  for (std::size_t i = 0; i < count; ++i) all[i] = int(i);
  std::vector<std::vector<int>> groups = GroupViews(workspace, all, progress);
  std::erase_if(groups, [](const std::vector<int>& group) { return group.size() < kLeastGroup; });
  return groups;
}

}  // namespace polarscan
