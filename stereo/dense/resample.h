// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

#include "core/formats/image_io.h"
#include "demosaic/stokes.h"
#include "stereo/sfm/model/camera_models.h"

namespace polarscan {

// How a view gets from the picture that was taken to the one that stereo uses: lens distortion off, then
// scaled. Interpolation is linear (OpenCV's remap, positions rounded to 1/32 pixel), scaling is area
// averaging. A result that touches a pixel outside of the picture, or an invalid one, is invalid: Stokes
// values 0, noise infinite; pictures and masks 0.
struct Resampling {
  Lens lens;       // of the picture that was taken
  Pinhole camera;  // of the result; its width and height are at most the lens's

  bool IsIdentity() const;
};

// The pinhole camera that keeps focal lengths, principal point and size, then scaled so that its longer side
// is at most max_size (0: any).
Resampling MakeResampling(const Lens& lens, int max_size);

// Stokes components are resampled one by one; angles never are. The lens does not turn the frame of the
// angles (camera_models.h). noise: interpolated (an upper bound), then AverageNoise.
StokesImage Resample(const StokesImage& image, const Resampling& resampling);
Picture Resample(const Picture& picture, const Resampling& resampling);
Image<std::uint8_t> Resample(const Image<std::uint8_t>& mask, const Resampling& resampling);

}  // namespace polarscan
