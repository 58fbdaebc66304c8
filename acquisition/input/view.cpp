// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>

#include "acquisition/input/forms/stokes.h"
#include "acquisition/input/input.h"
#include "acquisition/input/masks.h"
#include "acquisition/input/shot.h"
#include "acquisition/session/session_views.h"
#include "core/error.h"
#include "core/formats/tiff_pages.h"
#include "demosaic/hdr.h"
#include "demosaic/sensor/pixel_format.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

constexpr double kMayBeRinging = 0.01;  // of a channel's samples

std::string SizeOf(const Picture& picture) { return fmt::format("{}x{}", picture.width(), picture.height()); }

Picture PageAsPicture(const fs::path& path, const TiffPage& page) {
  Picture picture{ReadTiffSamples(path, page), 1, page.bits};
  picture.full_scale = page.bits == 8 ? 255 : page.bits == 16 ? 65535 : 1;
  picture.planes.resize(page.rgb ? 3 : 1);
  return picture;
}

Picture ReadPageOf(const InputView& view) {
  for (const TiffPage& page : TiffPages(view.files[0]))
    if (page.directory == view.page) return PageAsPicture(view.files[0], page);
  throw Error(fmt::format("page {} of this TIFF is not there any more", view.page), view.files[0].string());
}

// The pages of a TIFF, or the channels of its only one, a picture each.
std::vector<Picture> ReadStack(const fs::path& path) {
  const std::vector<TiffPage> pages = TiffPages(path);
  std::vector<Picture> pictures;
  if (pages.size() > 1) {
    for (const TiffPage& page : pages) pictures.push_back(PageAsPicture(path, page));
    return pictures;
  }
  const float full_scale = pages[0].bits == 8 ? 255 : pages[0].bits == 16 ? 65535 : 1;
  for (Image<float>& plane : ReadTiffSamples(path, pages[0]))
    pictures.push_back({{std::move(plane)}, full_scale, pages[0].bits});
  return pictures;
}

// S0, S0 + S1, S0 + S2 become S0, S1, S2.
void TakeSumsApart(std::vector<Picture>& pictures) {
  for (std::size_t k = 1; k < pictures.size(); ++k)
    for (std::size_t c = 0; c < std::min(pictures[k].planes.size(), pictures[0].planes.size()); ++c)
      if (SameSize(pictures[k].planes[c], pictures[0].planes[c]))
        for (std::size_t i = 0; i < pictures[k].planes[c].size(); ++i)
          pictures[k].planes[c].pixels()[i] -= pictures[0].planes[c].pixels()[i];
}

// Several files of one view must agree: always in size, and in channels and depth where they are of the same
// kind.
void CheckAgreement(const Input& input, const InputView& view, const std::vector<Picture>& pictures) {
  if (input.session) return;
  const Picture& first = pictures[0];
  for (std::size_t i = 1; i < pictures.size(); ++i) {
    const Picture& other = pictures[i];
    const std::string where = fmt::format("{} and {}", view.files[0].string(),
                                          view.files[std::min(i, view.files.size() - 1)].string());
    if (SizeOf(other) != SizeOf(first))
      throw Error(fmt::format("pictures of one view differ in size, {} and {}", SizeOf(first), SizeOf(other)),
                  where);
    if (input.kind == InputKind::kRgbAopDop) continue;
    if (other.planes.size() != first.planes.size() || other.bits != first.bits)
      throw Error("pictures of one view differ in colour or depth", where);
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

// Light has no sign, Stokes pictures do. A filter's ringing leaves a few samples below 0.
void RefuseSigns(const fs::path& path, const Picture& picture) {
  for (std::size_t c = 0; c < picture.planes.size(); ++c) {
    const auto& samples = picture.planes[c].pixels();
    const double below = double(std::ranges::count_if(samples, [](float v) { return v < 0; }));
    const double share = below / double(samples.size());
    if (share <= kMayBeRinging) continue;
    throw Error(
        fmt::format("{:.0f} % of the samples in channel {} are below 0: this is no photo", 100 * share,
                    c + 1),
        path.string(),
        fmt::format(
            "If the channels are S0, S1 and S2, save each in a file of its own: NAME_s0{0} NAME_s1{0} "
            "NAME_s2{0}, or NAME{0} in the folders s0/ s1/ s2/",
            path.extension().string()));
  }
}

void CheckPicture(const Input& input, const fs::path& path, Picture& picture) {
  if (picture.width() == 0) throw Error("the picture is empty", path.string());
  const bool floating = picture.bits == 32;
  if (input.kind == InputKind::kPhotos && floating) RefuseSigns(path, picture);
  if (input.kind == InputKind::kStokes && !floating)
    throw Error("Stokes pictures must be floating point (S1 and S2 have signs)", path.string(),
                "Use EXR, float TIFF or NPY");
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

std::vector<Picture> ReadPictures(const Input& input, const InputView& view, std::vector<double>& exposures) {
  if (input.session) return ReadShot(input, view, exposures);
  exposures = view.exposures;
  const bool one_file = view.files.size() == 1;
  if (input.kind == InputKind::kStokes && one_file) return ReadStokesFile(view.files[0]);
  if (input.kind == InputKind::kAngles && one_file) return ReadStack(view.files[0]);
  if (view.page >= 0) return {ReadPageOf(view)};
  std::vector<Picture> pictures;
  for (const fs::path& file : view.files) pictures.push_back(ReadPicture(file));
  if (view.sums) TakeSumsApart(pictures);
  return pictures;
}

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
  if (!input.parts.empty()) {
    const auto [part, view_of_part] = input.Source(index);
    LoadedView loaded = ReadView(*part, view_of_part);
    loaded.name = input.views[std::size_t(index)].name;
    return loaded;
  }
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
