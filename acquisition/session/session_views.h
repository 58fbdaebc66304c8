// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/session/session_reader.h"
#include "core/image.h"

namespace polarscan {

// The frames of one shot, as places in Session::frames.
struct SessionView {
  std::string name;  // the frames' own if it may be a file's name, else the shot's number in six digits
  std::vector<std::size_t> frames;
};

// Sorted by name.
std::vector<SessionView> ViewsOf(const Session& session);

// The exposure times of a view's frames, microseconds; empty if they are all the same (to 1 %) or not all
// known.
std::vector<double> ExposuresOf(const Session& session, const SessionView& view);

// "sensor" of session.json, with the bits of the first frame's pixel format where it does not say them.
nlohmann::json SensorOf(const Session& session);

// A frame's samples. Throws Error if its pixel format is no raw mosaic or the payload is too short.
Image<std::uint16_t> Counts(const Frame& frame);

// Median over the frames of a view, pixel by pixel (of an even number: mean of the middle two). Throws Error
// as ReadFrame does, and if the frames differ in size.
Image<float> MedianCounts(const Session& session, const SessionView& view);

}  // namespace polarscan
