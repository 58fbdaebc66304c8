// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/input/input.h"

namespace polarscan {

// What lies in the folder (and those in it) and is none of `taken`, one sentence a kind: how many, the first
// names, why, what to do. Not a word about what belongs beside pictures: masks/, sparse/, truth/, set.json,
// notes, previews, hidden files, scans.
std::vector<std::string> Untaken(const std::filesystem::path& folder, const std::vector<InputView>& taken);

// The same for messages where nothing was taken; empty if nothing lies there.
std::string WhatLiesThere(const std::filesystem::path& folder);

// Pictures of one set that are unlike: the depth of their samples, size, channels, as their headers say.
// Throws Error where they cannot be read as one set, else gives one sentence for each difference.
std::vector<std::string> Differences(const Input& input);

}  // namespace polarscan
