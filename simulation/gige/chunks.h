// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <set>

#include "acquisition/camera/frame.h"
#include "simulation/gige/protocol.h"

namespace polarscan {

// The picture, and behind it what the client wants to know of it (ids of kGigeChunks) and the source knows.
Bytes WithChunks(const Frame& frame, const gvsp::Image& image, const std::set<std::uint32_t>& ids);

// By how much that makes a picture longer where all of `count` chunks are known.
std::size_t BytesOfChunks(std::size_t count);

}  // namespace polarscan
