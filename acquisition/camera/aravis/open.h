// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <future>
#include <string>
#include <utility>

#include "acquisition/camera/aravis/glib_objects.h"

namespace polarscan::aravis {

// name: as OpenAravisCamera takes it. Throws NoSuchCamera, or Error if the camera cannot be opened.
Object<ArvCamera> Open(const std::string& name);

// A camera under the name that it has now.
using Found = std::pair<std::string, Object<ArvCamera>>;

// Looks for a camera that was there as `name` by its hardware address or, where it has none, its serial
// number. On a thread of its own, because it takes seconds where nobody answers: who ends the recording need
// not wait for it.
std::future<Found> Search(const std::string& name, const std::string& hardware, const std::string& serial);

}  // namespace polarscan::aravis
