// SPDX-License-Identifier: Apache-2.0
// What a camera must be set to so that its pictures can be used, where the user has not asked for something
// else.
#pragma once
#include <arv.h>

#include <functional>
#include <string>

#include "core/progress.h"

namespace polarscan::aravis {

// The camera, which features the user has set (they stay as they are), and who is told of the others.
struct PreferredSettings {
  ArvCamera* camera;
  std::function<bool(const std::string& feature)> is_set;
  Progress& progress;
};

// The deepest raw format. Throws Error if the camera, of this model, has none.
void ChoosePixelFormat(const PreferredSettings& settings, const std::string& model);

// Pictures of one set must be taken alike and be linear in light.
void SwitchAutomaticOff(const PreferredSettings& settings);

// Throws Error if an odd offset or a mirrored picture changes the polarizer layout.
void RefuseWhatChangesTheLayout(ArvCamera* camera);

}  // namespace polarscan::aravis
