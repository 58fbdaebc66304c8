// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <filesystem>

#include "core/image.h"

namespace polarscan {

// COLMAP's map files: ASCII "width&height&channels&", then float32 little endian, plane by plane, rows top to
// bottom. Depth: z in the camera frame, world units, 0 = invalid. Normal: unit, camera frame, n . ray < 0;
// zero = invalid. Readers check the header and the exact file size and throw Error naming the file. Writers
// are atomic.
Image<float> ReadDepthMap(const std::filesystem::path& path);
Image<Eigen::Vector3f> ReadNormalMap(const std::filesystem::path& path);
void WriteDepthMap(const std::filesystem::path& path, const Image<float>& depth);
void WriteNormalMap(const std::filesystem::path& path, const Image<Eigen::Vector3f>& normal);

}  // namespace polarscan
