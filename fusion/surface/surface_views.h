// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "core/image.h"
#include "demosaic/stokes.h"
#include "stereo/dense_view.h"

namespace polarscan {

// The views that a surface is held against. Their images are asked for as they are needed, by several threads
// at once (pipeline/workspace_views.h reads them from a dense workspace).
struct SurfaceViews {
  std::vector<DenseView> views;
  bool polarized = false;                             // false: S1 = S2 = 0 everywhere
  bool masked = false;                                // whether any view has a mask
  std::function<StokesImage(int view)> light;         // at the view's camera
  std::function<Image<std::uint8_t>(int view)> mask;  // 255 = object; empty where there is none
};

}  // namespace polarscan
