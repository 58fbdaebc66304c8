// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace polarscan {

using PictureFiles = std::map<std::string, std::filesystem::path>;  // by name, hence sorted

// The pictures of a folder and of the folders in it, by the views' names (core/view_name.h). Not looked at
// are hidden files and folders that mean something else: masks/, truth/, I-45/, a scan and the like. Throws
// Error if two have the same name.
PictureFiles ListPictureFiles(const std::filesystem::path& folder);
// Those without MasksAmong them.
PictureFiles ListPictures(const std::filesystem::path& folder);

// The masks that lie beside pictures: NAME.mask, NAME_mask or NAME-mask beside NAME.
PictureFiles MasksAmong(const PictureFiles& files);
// The names of views that a mask's stem may stand for, the likeliest first: a, a.mask, a_mask, a.png and
// a.png.mask all stand for a.
std::vector<std::string> NamesBehindMask(const std::string& stem);

// The folders in a folder, by their names in lower case.
std::map<std::string, std::filesystem::path> ListFolders(const std::filesystem::path& folder);

// The folders named after exposure times, exposure-500 or exposure_0.5, by time.
std::map<double, std::filesystem::path> ExposureFolders(const std::filesystem::path& folder);

// What a stem's end says: S0, S1, S2 as _s0, _s1, _s2 (or -s0, .s0; any case), and S0 + S1, S0 + S2 as _s0p1,
// _s0p2, which files without signs hold. component -1: nothing.
struct StokesEnding {
  int component = -1;
  bool is_sum = false;
  std::size_t length = 0;  // of the ending
};
StokesEnding StokesEndingOf(const std::string& stem);
// _s3 or _s0p3: circular polarization, which is not used.
bool IsUnusedComponent(const std::string& stem);
bool HoldStokesComponents(const PictureFiles& files);

}  // namespace polarscan
