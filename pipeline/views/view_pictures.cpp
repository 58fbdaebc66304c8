// SPDX-License-Identifier: Apache-2.0
#include "pipeline/views/view_pictures.h"

#include <algorithm>

#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "demosaic/false_colour.h"

namespace polarscan {
namespace {

constexpr float kDopFull = 0.5f;
constexpr int kWheelShare = 6, kSmallestWheel = 24;  // of the shorter side; px

Image<Rgb8> WithWheel(Image<Rgb8> picture, AopMap map) {
  const int side = std::min(picture.width(), picture.height());
  DrawLegend(AopWheel(std::max(side / kWheelShare, std::min(side, kSmallestWheel)), map), picture);
  return picture;
}

}  // namespace

void WriteViewPictures(const std::filesystem::path& folder, const PolarView& view, double s0_full) {
  std::filesystem::remove_all(folder);
  CreateFolder(folder);
  const StokesImage& stokes = view.stokes;
  const float full = float(s0_full);
  WritePng(folder / "s0.png", S0Picture(stokes, full));
  WritePng(folder / "diffuse.png", DiffusePicture(stokes, full));
  WritePng(folder / "specular.png", SpecularPicture(stokes, full));
  WritePng(folder / "dop.png", DopPicture(stokes, kDopFull));
  WritePng(folder / "aop.png", WithWheel(AngleOnlyPicture(stokes), AopMap::kHsv));
  WritePng(folder / "aop_dop.png", WithWheel(AopPicture(stokes, kDopFull), AopMap::kHsv));
  WritePng(folder / "aop_even.png", WithWheel(AopPicture(stokes, kDopFull, AopMap::kEven), AopMap::kEven));
  if (!view.redundancy.empty())
    WritePng(folder / "redundancy.png", RedundancyPicture(stokes, view.redundancy));
}

}  // namespace polarscan
