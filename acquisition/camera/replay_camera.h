// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "acquisition/camera/camera.h"

namespace polarscan {

// A session plays the camera that recorded it: the same payloads, bit for bit, and the same sequence numbers
// and gaps. Features: "speed" (2: twice as fast as recorded; 0: as fast as they are taken). A damaged frame
// comes as kDamaged. Throws Error if it is no session or holds no frames.
std::unique_ptr<Camera> OpenReplayCamera(const std::filesystem::path& session);

}  // namespace polarscan
