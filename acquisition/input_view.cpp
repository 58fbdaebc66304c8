// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>

#include "acquisition/input.h"
#include "acquisition/input_masks.h"
#include "acquisition/input_shot.h"
#include "acquisition/session/session_views.h"
#include "core/error.h"
#include "demosaic/hdr.h"
#include "demosaic/pixel_format.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

std::string SizeOf(const Picture& picture) { return fmt::format("{}x{}", picture.width(), picture.height()); }

// A TIFF of float pages as one grey picture a page.
std::vector<Picture> ReadPages(const fs::path& path) {
  std::vector<Picture> pictures;
  for (Image<float>& page : ReadFloatTiff(path)) pictures.push_back({{std::move(page)}, 1, 32});
  if (pictures.size() != 3 && pictures.size() != 4)
    throw Error(
        fmt::format("a Stokes file has 3 or 4 pages (S0, S1, S2, noise), this one has {}", pictures.size()),
        path.string());
  return pictures;
}

std::vector<Picture> ReadPictures(const Input& input, const InputView& view, std::vector<double>& exposures) {
  if (input.session) return ReadShot(input, view, exposures);
  exposures = view.exposures;
  if (input.kind == InputKind::kStokes && view.files.size() == 1) return ReadPages(view.files[0]);
  std::vector<Picture> pictures;
  for (const fs::path& file : view.files) pictures.push_back(ReadPicture(file));
  return pictures;
}

// Several files of one view must agree: always in size, and in channels and depth where they are of the same
// kind.
void CheckAgreement(const Input& input, const InputView& view, const std::vector<Picture>& pictures) {
  const Picture& first = pictures[0];
  for (std::size_t i = 1; i < std::min(pictures.size(), view.files.size()); ++i) {
    const Picture& other = pictures[i];
    if (SizeOf(other) != SizeOf(first))
      throw Error(fmt::format("pictures of one view differ in size, {} and {}", SizeOf(first), SizeOf(other)),
                  fmt::format("{} and {}", view.files[0].string(), view.files[i].string()));
    if (input.kind == InputKind::kRgbAopDop) continue;
    if (other.planes.size() != first.planes.size() || other.bits != first.bits)
      throw Error("pictures of one view differ in colour or depth",
                  fmt::format("{} and {}", view.files[0].string(), view.files[i].string()));
  }
}

// Counts above the declared depth mean that it is wrong.
void CheckDepth(const Input& input, const fs::path& path, const Picture& picture) {
  const bool counts = input.kind == InputKind::kMosaic || input.kind == InputKind::kAngles;
  if (!counts || input.sensor.bits >= picture.bits) return;
  for (const Image<float>& plane : picture.planes) {
    const float highest = *std::ranges::max_element(plane.pixels());
    if (highest > float((1 << input.sensor.bits) - 1))
      throw Error(
          fmt::format("a count of {} does not fit in {} bits", highest, input.sensor.bits), path.string(),
          "Check --bits; samples moved to the upper end of 16 bits need --bits 16 with --white-level");
  }
}

void CheckPicture(const Input& input, const fs::path& path, Picture& picture) {
  if (picture.width() == 0) throw Error("the picture is empty", path.string());
  const bool floating = picture.bits == 32;
  if (input.kind == InputKind::kStokes && !floating)
    throw Error("Stokes pictures must be floating point (S1 and S2 have signs)", path.string(),
                "Use EXR or float TIFF");
  if ((input.kind == InputKind::kMosaic || input.kind == InputKind::kAngles) &&
      floating != (input.sensor.bits == 32))
    throw Error("some pictures are floating point and others are not", path.string());
  CheckDepth(input, path, picture);
  if (input.kind != InputKind::kMosaic) return;
  if (!IsGrey(picture))
    throw Error("a raw mosaic has one channel, this picture has colours", path.string(),
                "Use --input-kind photos if these are plain photos");
  picture.planes.resize(1);
}

// Where a picture comes from, for messages.
fs::path PathOf(const Input& input, const InputView& view, std::size_t picture) {
  return input.session ? input.folder / view.name : view.files[std::min(picture, view.files.size() - 1)];
}

}  // namespace

std::vector<Picture> ReadShot(const Input& input, const InputView& view, std::vector<double>& exposures) {
  std::map<double, std::vector<std::size_t>> by_exposure;
  for (std::size_t i = 0; i < view.frames.size(); ++i)
    by_exposure[view.exposures.empty() ? 0 : view.exposures[i]].push_back(view.frames[i]);
  std::vector<Picture> pictures;
  for (const auto& [exposure, frames] : by_exposure) {
    Picture picture;
    picture.planes.push_back(MedianCounts(*input.session, {view.name, frames}));
    const std::string& format = input.session->frames[frames[0]].info.pixel_format;
    picture.bits = ParsePixelFormat(format).bits == 8 ? 8 : 16;
    picture.full_scale = picture.bits == 8 ? 255 : 65535;
    pictures.push_back(std::move(picture));
    if (!view.exposures.empty()) exposures.push_back(exposure);
  }
  return pictures;
}

LitMosaic MosaicOf(const Input& input, const LoadedView& view) {
  if (view.exposures.empty())
    return ToLitMosaic(view.pictures[0].planes[0], input.sensor, input.correction());
  std::vector<Exposure> exposures;
  for (std::size_t i = 0; i < view.pictures.size(); ++i)
    exposures.push_back({view.pictures[i].planes[0], view.exposures[i]});
  return MergeExposures(exposures, input.sensor, input.correction());
}

LoadedView ReadView(const Input& input, int index) {
  const InputView& view = input.views[std::size_t(index)];
  LoadedView loaded{view.name, {}, {}};
  loaded.pictures = ReadPictures(input, view, loaded.exposures);
  for (std::size_t i = 0; i < loaded.pictures.size(); ++i)
    CheckPicture(input, PathOf(input, view, i), loaded.pictures[i]);
  CheckAgreement(input, view, loaded.pictures);
  const Picture& first = loaded.pictures[0];
  loaded.mask = view.mask ? ReadMaskOf(view, first.width(), first.height()) : MaskFromAlpha(first);
  return loaded;
}

}  // namespace polarscan
