// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace polarscan {

using PictureFiles = std::map<std::string, std::filesystem::path>;  // by stem, hence sorted

// The picture files of a folder; hidden files are not looked at. Throws Error if two have the same stem.
PictureFiles ListPictureFiles(const std::filesystem::path& folder);
// Those without MasksAmong them.
PictureFiles ListPictures(const std::filesystem::path& folder);

// The masks that lie beside pictures: NAME.mask, NAME_mask or NAME-mask beside NAME.
PictureFiles MasksAmong(const PictureFiles& files);
// The names of views that a mask's stem may stand for, the likeliest first: a, a.mask, a_mask, a.png and
// a.png.mask all stand for a.
std::vector<std::string> NamesBehindMask(const std::string& stem);

// "a, b, c and 4 more"
std::string FirstOf(const std::vector<std::string>& names);

// The folders in a folder, by their names in lower case.
std::map<std::string, std::filesystem::path> ListFolders(const std::filesystem::path& folder);

// The folders named after polarizer angles: I-00, i45, I_090, 135. Throws Error if two stand for the same
// angle.
std::map<int, std::filesystem::path> AngleFolders(const std::filesystem::path& folder);

// The folders named after exposure times, exposure-500 or exposure_0.5, by time.
std::map<double, std::filesystem::path> ExposureFolders(const std::filesystem::path& folder);

// 0, 1, 2 if the stem ends in _s0, _s1, _s2 (or -s0, .s0; any case); -1 otherwise.
int StokesComponent(const std::string& stem);
bool HoldStokesComponents(const PictureFiles& files);

std::string LowerCase(std::string text);

}  // namespace polarscan
