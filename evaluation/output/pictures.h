// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/image.h"

namespace polarscan {

// Errors as heat, `limit` and above is full; blue where nothing was estimated (infinite), kNoData where there
// is no object (NaN).
Image<Rgb8> ErrorPicture(const Image<float>& errors, double limit);

}  // namespace polarscan
