// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace polarscan {

// One view of the folder that demosaicing wrote: NAME.tif (Stokes) and NAME.png (picture).
struct ListedView {
  std::string name;
  int width = 0, height = 0;

  std::string PictureName() const { return name + ".png"; }
};

// The views of a folder, sorted by name. Reads each picture, so that a damaged one is found here and named.
// Throws Error if there are fewer than two, or a Stokes file lacks its picture.
std::vector<ListedView> ListViews(const std::filesystem::path& views);

// Enumerate (core/words.h) for names of some of the views, all of them: neighbours are put together, "000,
// 003 to 007, 011".
std::string EnumerateRuns(const std::vector<std::string>& names, const std::vector<ListedView>& views);

}  // namespace polarscan
