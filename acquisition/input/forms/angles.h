// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "acquisition/input/files.h"

namespace polarscan {

// Polarizer angles in degrees, of --angles: "0,60,120" or "0 60 120". Throws Error if they are no numbers or
// if fewer than three differ (180 degrees are 0).
std::vector<double> ParseAngles(const std::string& text);

// "0 60 120"
std::string AnglesText(const std::vector<double>& angles);
// "--angles 0,60,120"
std::string AnglesOption(const std::vector<double>& angles);

// The folders named after polarizer angles: I-00, i45, I_090, 135, pol-22.5, 60deg. Throws Error if two stand
// for the same one of 0, 45, 90, 135.
std::map<double, std::filesystem::path> AngleFolders(const std::filesystem::path& folder);

// Whose folders these are without --angles: all of them if they divide 180 degrees evenly from 0 on, or 0 45
// 90 135 if at least two of those are there; none otherwise.
std::vector<double> AnglesOfFolders(const std::filesystem::path& folder);

// The angles that the names of three or more folders may stand for, whose pictures have the same names;
// none otherwise. For questions to the user: plain folders may have numbers for names too.
std::vector<double> AnglesNamesMayMean(const std::filesystem::path& folder);

// Pictures with the angle in their names, NAME_60 or NAME-060deg: for each of the angles the pictures by
// NAME.
std::vector<PictureFiles> SplitByAngle(const PictureFiles& files, const std::vector<double>& angles);

// Whether every one of the pictures is of a view that has exactly those four: NAME_0 NAME_45 NAME_90
// NAME_135.
bool AreNamedByFourAngles(const PictureFiles& files);

}  // namespace polarscan
