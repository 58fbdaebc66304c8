// SPDX-License-Identifier: Apache-2.0
// Aravis puts a frame's packets together in a buffer (its arvgvstream.c and arvuvstream.c); here that buffer
// becomes a frame of ours, or a reason why it is none.
#pragma once
#include <arv.h>

#include <cstdint>
#include <string>
#include <vector>

#include "acquisition/camera/frame.h"

namespace polarscan::aravis {

// What every frame of a stream is, as the camera is set.
struct FrameShape {
  std::string pixel_format;   // its PFNC name
  std::uint32_t code = 0;     // its PFNC code
  int width = 0, height = 0;  // px
  bool gige = false;          // else USB
};

// False for packets that belong to no frame, say a late test packet, and where a GigE camera's leader never
// came, so that nobody knows which frame it was; it shows as a gap.
bool HoldsAFrame(ArvBuffer* buffer, const FrameShape& shape);

// What is wrong with the frame in the buffer; empty if it is whole and of this shape. Fills in its size and,
// where the camera says so with this very picture, exposure and gain.
std::string WhatIsWrong(ArvBuffer* buffer, const FrameShape& shape, ArvChunkParser* chunks, FrameInfo& info);

// The memory that a buffer is made of, which is its user data.
using Payload = std::vector<std::uint8_t>;

// Moves the picture out of a buffer with which nothing is wrong, without what comes behind it. Returns what
// memory `picture` had before.
Payload TakePicture(ArvBuffer* buffer, const FrameInfo& info, Payload& picture);

}  // namespace polarscan::aravis
