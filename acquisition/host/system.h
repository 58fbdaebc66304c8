// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/camera/camera.h"
#include "acquisition/host/host.h"

struct timex;

namespace polarscan {

// The cameras that ListCameras found; the simulated one does not count.
HostCheck CheckCameras(const std::vector<CameraInfo>& cameras);

// V4L2 devices that this user may not open.
std::vector<HostCheck> CheckVideoDevices(const Host& host);

// Open files, locked memory and real-time priority that this program is allowed.
HostCheck CheckLimits(const Host& host);

// Whether somebody keeps the clock right. state, clock: what ntp_adjtime returned and filled in.
HostCheck CheckClock(int state, const timex& clock);
HostCheck CheckClock();

}  // namespace polarscan
