// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "acquisition/input_files.h"
#include "acquisition/input_forms.h"
#include "core/error.h"
#include "core/files.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

bool IsStokesFile(const fs::path& path, const Picture& picture) {
  return picture.bits == 32 && LowerCase(path.extension().string()).starts_with(".tif") &&
         ReadFloatTiff(path).size() >= 3;
}

// Pictures that lie flat in the folder: what they are shows in their names or in the first one.
InputKind RecognizeFlat(const fs::path& folder, const InputOptions& options) {
  const PictureFiles files = ListPictures(folder);
  if (files.empty())
    throw Error("there are no pictures here", folder.string(),
                "Give a folder with pictures (PNG, JPEG, TIFF or EXR), or one with mosaic/, I-00/ I-45/ "
                "I-90/ I-135/, "
                "stokes/ or rgb/ aop/ dop/");
  if (HoldStokesComponents(files)) return InputKind::kStokes;
  const auto& [name, path] = *files.begin();
  const Picture first = ReadPicture(path);
  if (IsStokesFile(path, first)) return InputKind::kStokes;
  if (!IsGrey(first)) return InputKind::kPhotos;
  if (!options.layout.empty()) return InputKind::kMosaic;
  throw Error("these grey pictures may be raw mosaics or plain photos", folder.string(),
              "Give --input-kind mosaic --layout \"90 45 / 135 0\" (with your sensor's angles) or "
              "--input-kind photos");
}

InputKind KindOf(const std::string& name) {
  for (const InputKind kind : {InputKind::kMosaic, InputKind::kAngles, InputKind::kStokes,
                               InputKind::kRgbAopDop, InputKind::kPhotos})
    if (ToString(kind) == name) return kind;
  throw Error("there is no such kind of input", name);
}

}  // namespace

InputKind RecognizeKind(const fs::path& folder, const InputOptions& options) {
  if (options.kind != "auto") return KindOf(options.kind);
  if (IsViewFolder(folder))
    return ReadJson(folder / "views.json")["polarized"] == true ? InputKind::kStokes : InputKind::kPhotos;
  const auto folders = ListFolders(folder);
  std::vector<InputKind> kinds;
  if (folders.contains("mosaic") || !ExposureFolders(folder).empty()) kinds.push_back(InputKind::kMosaic);
  if (AngleFolders(folder).size() >= 2) kinds.push_back(InputKind::kAngles);
  if (folders.contains("stokes") || (folders.contains("s0") && folders.contains("s1")))
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
