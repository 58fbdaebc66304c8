// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>

#include "stereo/sfm/model/model.h"

namespace polarscan {

// What the text and the binary form of a sparse model share (model.h has the functions for everybody else).
constexpr std::uint64_t kLargestPicture = 1u << 20;  // pixels a side

// notes: as ReadSparseModel.
SparseModel ReadBinaryModel(const std::filesystem::path& folder, std::vector<std::string>& notes);
SparseModel ReadTextModel(const std::filesystem::path& folder, std::vector<std::string>& notes);

// qw qx qy qz tx ty tz, as both forms store a pose. SetPose normalises the quaternion; false if it is no
// rotation.
std::array<double, 7> GetPose(const Rigid& cam_from_world);
bool SetPose(const double* values, Rigid& cam_from_world);

// Whether a pose's quaternion is further from length 1 than rounding explains.
bool IsStretched(const double* pose);
// Adds a note on such poses if there are any.
void AddNoteOnLengths(const std::vector<std::string>& stretched, const std::filesystem::path& path,
                      std::vector<std::string>& notes);

}  // namespace polarscan
