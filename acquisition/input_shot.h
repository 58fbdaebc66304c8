// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/input.h"

namespace polarscan {

// A view of a session as a picture: counts of 8 bits, or of more in 16. Throws Error as MedianCounts does.
Picture ReadShot(const Input& input, const InputView& view);

}  // namespace polarscan
