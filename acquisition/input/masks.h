// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/input/input.h"

namespace polarscan {

// Sets the views' masks: FOLDER/masks/NAME.* (MaskFolder), also named after the whole file as COLMAP wants it
// (NAME.jpg.png), with an ending as OpenMVS and others want it (NAME.mask.png, NAME_mask.png), or so beside
// the picture. Masks without a picture are named in input.warnings. Throws Error if there are masks and none
// of them matches a view, or two match the same.
void FindMasks(Input& input);

// Where the masks of a folder of pictures lie: masks/, or Masks/, mask/ and so on; empty: nowhere.
std::filesystem::path MaskFolder(const std::filesystem::path& folder);

// The view's mask as its picture, which is width x height px, is stored: turned where EXIF says that one of
// the two is shown otherwise than it is stored. Throws Error if it has another size.
Image<std::uint8_t> ReadMaskOf(const InputView& view, int width, int height);

// Reads all masks of the input's masks/. Returns what is odd about them, one sentence each: empty ones, full
// ones, inverted ones, turned ones. Throws Error if all are empty, or one's size is not its picture's.
std::vector<std::string> CheckMasks(const Input& input, const Progress& progress);

}  // namespace polarscan
