// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "acquisition/input/files.h"
#include "acquisition/input/forms/angles.h"
#include "acquisition/input/forms/forms.h"
#include "acquisition/input/forms/stokes.h"
#include "acquisition/input/ignored_files.h"
#include "core/error.h"
#include "core/files/files.h"
#include "core/formats/exr.h"
#include "core/formats/tiff_pages.h"
#include "core/words.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

bool IsStokesFile(const fs::path& path) {
  if (LowerCase(path.extension().string()) == ".exr") return HoldStokesChannels(ExrChannels(path));
  if (!IsTiff(path)) return false;
  const std::vector<TiffPage> pages = TiffPages(path);
  return pages.size() >= 3 && pages[0].floating && pages[0].bits == 32 && pages[0].samples == 1;
}

// A TIFF whose pages or channels may be the four angles of one view, or pictures of their own.
void RefuseStackOfFour(const fs::path& path) {
  if (!IsTiff(path)) return;
  const std::vector<TiffPage> pages = TiffPages(path);
  const bool channels = pages[0].samples == 4 && !pages[0].rgb;
  if (!channels && !(pages.size() == 4 && pages[0].samples == 1)) return;
  throw Error(fmt::format("the four {} of this TIFF may be the polarizer angles of one view{}",
                          channels ? "channels" : "pages", channels ? "" : ", or four raw mosaics or photos"),
              path.string(),
              fmt::format("Give --input-kind angles (in the order 0 45 90 135; another with --angles){}",
                          channels ? "" : ", or --input-kind mosaic or photos"));
}

// Pictures that lie flat in the folder: what they are shows in their names or in the first one.
InputKind RecognizeFlat(const fs::path& folder, const InputOptions& options) {
  const PictureFiles files = ListPictures(folder);
  if (files.empty()) {
    const std::string there = WhatLiesThere(folder);
    throw Error("there are no pictures here", folder.string(),
                (there.empty() ? "" : there + ". ") +
                    "Give a folder with pictures (PNG, JPEG, TIFF, EXR, BMP, PGM), or one with mosaic/, "
                    "I-00/ I-45/ I-90/ I-135/, stokes/ or rgb/ aop/ dop/");
  }
  if (HoldStokesComponents(files)) return InputKind::kStokes;
  if (!options.angles.empty() || AreNamedByFourAngles(files)) return InputKind::kAngles;
  const auto& [name, path] = *files.begin();
  if (IsStokesFile(path)) return InputKind::kStokes;
  RefuseStackOfFour(path);
  const Picture first = ReadPicture(path);
  if (!IsGrey(first)) return InputKind::kPhotos;
  if (!options.layout.empty()) return InputKind::kMosaic;
  if (const auto angles = AnglesNamesMayMean(folder); !angles.empty())
    throw Error(
        fmt::format("the folders {} look like the angles of a polarizer", AnglesText(angles)),
        folder.string(),
        fmt::format("If they are, give {}; if not, --input-kind photos or mosaic", AnglesOption(angles)));
  const bool asks_bits = first.bits == 16 && options.bits == 0 && options.white_level <= 0;
  throw Error(
      "these grey pictures may be raw mosaics or plain photos", folder.string(),
      fmt::format(
          "Give --input-kind mosaic --layout \"90 45 / 135 0\" (with your sensor's angles){}, or "
          "--input-kind photos; if a polarizer was turned before the camera: --angles 0,45,90,135 (yours)",
          asks_bits ? " --bits 12 (or 10, 14, 16: how many of the 16 it uses)" : ""));
}

InputKind KindOf(const std::string& name) {
  for (const InputKind kind : {InputKind::kMosaic, InputKind::kAngles, InputKind::kStokes,
                               InputKind::kRgbAopDop, InputKind::kPhotos})
    if (ToString(kind) == name) return kind;
  throw Error("there is no such kind of input", name);
}

bool HoldGivenAngles(const fs::path& folder, const InputOptions& options) {
  if (options.angles.empty()) return false;
  const auto folders = AngleFolders(folder);
  return std::ranges::any_of(ParseAngles(options.angles),
                             [&](double angle) { return folders.contains(angle); });
}

}  // namespace

InputKind RecognizeKind(const fs::path& folder, const InputOptions& options) {
  if (options.kind != "auto") return KindOf(options.kind);
  if (IsViewFolder(folder))
    return ReadJson(folder / "views.json")["polarized"] == true ? InputKind::kStokes : InputKind::kPhotos;
  const auto folders = ListFolders(folder);
  std::vector<InputKind> kinds;
  if (folders.contains("mosaic") || !ExposureFolders(folder).empty()) kinds.push_back(InputKind::kMosaic);
  if (!AnglesOfFolders(folder).empty() || HoldGivenAngles(folder, options))
    kinds.push_back(InputKind::kAngles);
  if (folders.contains("stokes") ||
      (folders.contains("s0") && (folders.contains("s1") || folders.contains("s0p1"))))
    kinds.push_back(InputKind::kStokes);
  if (folders.contains("aop") && folders.contains("dop")) kinds.push_back(InputKind::kRgbAopDop);
  if (folders.contains("photos") || folders.contains("images")) kinds.push_back(InputKind::kPhotos);
  if (kinds.empty()) return RecognizeFlat(folder, options);
  if (kinds.size() == 1) return kinds[0];
  throw Error(fmt::format("the folder holds pictures of several kinds ({} and {})", ToString(kinds[0]),
                          ToString(kinds[1])),
              folder.string(), fmt::format("Say which to use, as in --input-kind {}", ToString(kinds[0])));
}

}  // namespace polarscan
