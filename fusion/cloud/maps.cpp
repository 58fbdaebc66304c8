// SPDX-License-Identifier: Apache-2.0
#include "fusion/cloud/maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/formats/image_io.h"
#include "demosaic/stokes.h"
#include "stereo/map_io.h"

namespace polarscan {
namespace {

// The value of `image` at the centre of pixel (x, y) of a width x height grid over the same picture.
template <class T>
const T& At(const Image<T>& image, int x, int y, int width, int height) {
  const int sx = int((x + 0.5) * image.width() / width), sy = int((y + 0.5) * image.height() / height);
  return image(std::min(sx, image.width() - 1), std::min(sy, image.height() - 1));
}

template <class F>
void ForEachPixel(const Image<float>& grid, F&& f) {
  for (int y = 0; y < grid.height(); ++y)
    for (int x = 0; x < grid.width(); ++x) f(x, y);
}

void RemoveUnusable(ViewMaps& maps, const Image<std::uint8_t>& mask) {
  const int width = maps.depth.width(), height = maps.depth.height();
  ForEachPixel(maps.depth, [&](int x, int y) {
    float& depth = maps.depth(x, y);
    const bool estimated = std::isfinite(depth) && depth > 0;
    const bool masked = !mask.empty() && At(mask, x, y, width, height) == 0;
    const float length = maps.normal(x, y).norm();
    const bool normal = std::isfinite(length) && length > 1e-6f;
    maps.pixels_inside += !masked, maps.pixels_outside += masked;
    maps.pixels_with_depth += estimated;
    maps.pixels_masked += estimated && masked;
    maps.pixels_without_normal += estimated && !masked && !normal;
    if (estimated && normal && !masked) {
      maps.normal(x, y) /= length;
    } else {
      depth = 0;
    }
  });
}

Image<Rgb8> Colours(const Workspace& workspace, int view, int width, int height) {
  Picture picture = ReadPicture(workspace.PicturePath(view));
  for (auto& plane : picture.planes) plane = InWindow(workspace.views[std::size_t(view)], std::move(plane));
  const std::size_t green = picture.planes.size() > 1 ? 1 : 0, blue = picture.planes.size() > 2 ? 2 : 0;
  const float scale = 255 / picture.full_scale;
  const auto byte = [&](std::size_t plane, int x, int y) {
    return std::uint8_t(
        std::clamp(std::lround(At(picture.planes[plane], x, y, width, height) * scale), 0l, 255l));
  };
  Image<Rgb8> colours(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) colours(x, y) = {byte(0, x, y), byte(green, x, y), byte(blue, x, y)};
  return colours;
}

Image<float> Dops(const Workspace& workspace, int view, int width, int height) {
  const StokesImage stokes = ReadViewLight(workspace, view);
  Image<float> dop(width, height);
  ForEachPixel(dop, [&](int x, int y) {
    const float value =
        DegreeOfPolarization(At(stokes.s0, x, y, width, height), At(stokes.s1, x, y, width, height),
                             At(stokes.s2, x, y, width, height));
    dop(x, y) = std::isfinite(value) ? std::clamp(value, 0.f, 1.f) : 0.f;
  });
  return dop;
}

}  // namespace

bool HasMaps(const Workspace& workspace, int view, const MapKind& kind) {
  return std::filesystem::exists(workspace.DepthPath(view, kind));
}

MapKind BestMapKind(const Workspace& workspace) {
  for (const MapKind& kind : kResults)
    for (int i = 0; i < int(workspace.views.size()); ++i)
      if (HasMaps(workspace, i, kind)) return kind;
  throw Error("there are no depth maps", (workspace.folder / "stereo/depth_maps").string(),
              "Run polarscan stereo first");
}

MapKind MapKindOf(const std::string& name, const Workspace& workspace) {
  return name == "auto" ? BestMapKind(workspace) : ParseResult(name);
}

ViewMaps LoadViewMaps(const Workspace& workspace, int view, const MapKind& kind, bool masks) {
  ViewMaps maps;
  maps.depth = ReadDepthMap(workspace.DepthPath(view, kind));
  maps.normal = ReadNormalMap(workspace.NormalPath(view, kind));
  if (!SameSize(maps.depth, maps.normal))
    throw Error("depth and normal map differ in size", workspace.NormalPath(view, kind).string(),
                "Remove both and run polarscan stereo again");
  const int width = maps.depth.width(), height = maps.depth.height();
  maps.camera = workspace.views[std::size_t(view)].camera.Resized(width, height);
  maps.cam_from_world = workspace.views[std::size_t(view)].cam_from_world;
  RemoveUnusable(maps, masks ? ReadViewMask(workspace, view) : Image<std::uint8_t>());
  if (!masks && std::filesystem::exists(workspace.MaskPath(view))) maps.pixels_inside = 0;
  maps.colour = Colours(workspace, view, width, height);
  maps.dop = workspace.polarized ? Dops(workspace, view, width, height) : Image<float>(width, height);
  return maps;
}

Cache<MapsOrDamage> CachedViewMaps(const Workspace& workspace, const MapKind& kind, bool masks,
                                   std::size_t limit_bytes) {
  const auto load = [&workspace, kind, masks](int view) -> MapsOrDamage {
    try {
      return {LoadViewMaps(workspace, view, kind, masks), ""};
    } catch (const Error& error) {
      return {{}, error.what()};
    }
  };
  return {limit_bytes, load, [](const MapsOrDamage& loaded) { return loaded.maps.Bytes(); }};
}

}  // namespace polarscan
