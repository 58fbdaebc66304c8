// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/input/input.h"

namespace polarscan {

// Which of the forms in input.h the folder has, by its folder names, file names and, for pictures that lie
// flat, by looking into the first one. Throws Error naming --input-kind where that does not decide.
InputKind RecognizeKind(const std::filesystem::path& folder, const InputOptions& options);

// Whether `polarscan demosaic` made the folder, by its views.json (pipeline/views/views.h).
bool IsViewFolder(const std::filesystem::path& folder);

// Sets views of input.kind in input.folder, sorted by name, without masks, and their polarizer angles;
// `angles`: of --angles, may be empty. Throws Error if there are none, and if folders that belong together
// hold different names.
void FindViews(const std::string& angles, Input& input);

}  // namespace polarscan
