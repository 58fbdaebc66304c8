// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "acquisition/input/input.h"
#include "apps/command.h"

namespace polarscan {

// `polarscan check` of a folder of pictures (docs/input.md): what form it has, its views, masks and poses,
// what is odd; reads every picture. Damage is what cannot be read or does not fit. Throws Error if it is no
// input.
void CheckInputFolder(const std::filesystem::path& folder, const InputOptions& options, Context& context);

}  // namespace polarscan
