// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

#include "core/image.h"

namespace polarscan {

// Gives parts of a mask, and holes in it, that are much smaller than its object (a fiftieth of its size, by length) to what
// lies around them.
void DropSpecks(Image<std::uint8_t>& mask);

}  // namespace polarscan
