// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/input/input.h"
#include "core/formats/image_io.h"

namespace polarscan {

// What an opened folder's user should know: notes of what was assumed, warnings of what is likely wrong. They are added
// to the input's own. first: the first view's (first) picture, as its file holds it.
void AddNotes(Input& input, const InputOptions& options, const Picture& first);
void AddWarnings(Input& input, const InputOptions& options, const Picture& first);

// given: the options before the folder was asked.
void WarnOfUnusedLayout(Input& input, const InputOptions& given);

}  // namespace polarscan
