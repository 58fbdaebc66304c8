// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>

#include "stereo/sfm/model.h"

namespace polarscan {

// What the text and the binary form of a sparse model share (model.h has the functions for everybody else).
constexpr std::uint64_t kLargestPicture = 1u << 20;  // pixels a side

SparseModel ReadBinaryModel(const std::filesystem::path& folder);
SparseModel ReadTextModel(const std::filesystem::path& folder);

// qw qx qy qz tx ty tz, as both forms store a pose. SetPose normalises the quaternion; false if it is no
// rotation.
std::array<double, 7> GetPose(const Rigid& cam_from_world);
bool SetPose(const double* values, Rigid& cam_from_world);

}  // namespace polarscan
