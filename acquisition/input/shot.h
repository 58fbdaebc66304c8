// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/input/input.h"

namespace polarscan {

// A view of a session as pictures: counts of 8 bits, or of more in 16; one picture, or one an exposure where
// the shot has several (its times in `exposures`). Throws Error as MedianCounts does.
std::vector<Picture> ReadShot(const Input& input, const InputView& view, std::vector<double>& exposures);

// A view's pictures as its files hold them (see LoadedView), not looked at yet. Throws Error if a file is
// damaged.
std::vector<Picture> ReadPictures(const Input& input, const InputView& view, std::vector<double>& exposures);

}  // namespace polarscan
