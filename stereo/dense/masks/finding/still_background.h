// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "core/progress.h"
#include "demosaic/stokes.h"
#include "stereo/dense/masks/finding/noise_by_brightness.h"
#include "stereo/workspace.h"

namespace polarscan {

// The background that views of one camera share, at the same place in the picture, while an object turns before it: the light
// of each pixel in those views where nothing hides it. Found from some of the views: what pixels have in common most often,
// as far as it hangs together with the picture's border. What no view shows is behind the object in all of them.
class StillBackground {
 public:
  StillBackground(const Workspace& workspace, const std::vector<int>& views, Progress& progress);

  // What hides it in a view of the same camera, 255, to the pixel (outline_cut.h). difference: if given, becomes the light
  // less the background, without sign, whose edges are the object's.
  Image<std::uint8_t> ObjectIn(const StokesImage& light, StokesImage* difference = nullptr) const;

 private:
  using Noise = std::array<NoiseByBrightness, 3>;  // of S0, S1, S2
  void Add(const StokesImage& light, const cv::Mat_<std::uint8_t>& background, Image<float>& count);
  Image<std::uint8_t> HiddenBy(const std::array<cv::Mat_<float>, 3>& differences) const;
  Noise Measure(const std::array<cv::Mat_<float>, 3>& differences) const;

  StokesImage light_;          // 0 where it is not known
  Image<std::uint8_t> known_;  // 1: it is
  cv::Mat_<float> usual_;      // S0 of the views in cells, its median
  float bright_ = 1;           // S0 that is called bright
};

}  // namespace polarscan
