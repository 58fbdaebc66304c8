// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/camera/camera.h"

namespace polarscan {

// Video capture devices that offer a raw mosaic. Their ids are /dev/v4l/by-id/... where there is such a link,
// because /dev/videoN is another camera tomorrow.
std::vector<CameraInfo> ListV4l2Cameras();

// device: a path. Features: pixel-format, width, height, fps, input, buffers, and the driver's controls by
// their names as v4l2-ctl writes them (exposure_time_absolute). Frames are copied out of the driver's buffers
// as they are. After a fatal error in the stream, or when the device was gone, Next starts again
// (Delivery::kRestarted).
std::unique_ptr<Camera> OpenV4l2Camera(const std::string& device);

}  // namespace polarscan
