// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "core/progress.h"

namespace polarscan {

// Each reads one file or folder whole, as the stages do, and looks at every value. Throws Error if it is
// damaged: what is wrong, and in which file.

// COLMAP's map files: depths finite and not negative, normals finite and unit or zero.
void CheckMap(const std::filesystem::path& path);
// Clouds and meshes: coordinates and normals finite, triangles between vertices that exist.
void CheckPly(const std::filesystem::path& path);
// A sparse model, binary or text: numbers finite; cameras, pictures and points that name each other exist.
void CheckModel(const std::filesystem::path& folder);
// A dense workspace: views.json, light, mask and those maps that are there, of the sizes of the cameras.
void CheckWorkspace(const std::filesystem::path& folder);
void CheckWorkspace(const std::filesystem::path& folder, Progress& progress);  // the same; throws Cancelled
// TIFF of floats (Stokes views), or a picture.
void CheckPicture(const std::filesystem::path& path);

}  // namespace polarscan
