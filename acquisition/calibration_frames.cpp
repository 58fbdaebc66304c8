// SPDX-License-Identifier: Apache-2.0
#include "acquisition/calibration_frames.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"

namespace polarscan {
namespace {

// Every frame of a session as a view of its own.
Input SplitShots(const Input& input) {
  Input split = input;
  split.views.clear();
  for (const InputView& view : input.views)
    for (std::size_t i = 0; i < view.frames.size(); ++i)
      split.views.push_back({view.frames.size() == 1 ? view.name : fmt::format("{}-{}", view.name, i),
                             {},
                             std::nullopt,
                             {view.frames[i]}});
  return split;
}

}  // namespace

CalibrationFrames FramesOf(std::shared_ptr<const Input> input, bool single) {
  if (input->kind != InputKind::kMosaic)
    throw Error(fmt::format("a calibration needs raw mosaics, these are {}", ToString(input->kind)),
                input->folder.string());
  if (!single &&
      std::ranges::any_of(input->views, [](const InputView& view) { return !view.exposures.empty(); }))
    throw Error("a calibration needs frames of one exposure each", input->folder.string());
  if (single && input->session) input = std::make_shared<Input>(SplitShots(*input));
  CalibrationFrames frames;
  for (const InputView& view : input->views) frames.names.push_back(view.name);
  frames.counts = [input](int k) {
    Image<float> counts = std::move(ReadView(*input, k).pictures[0].planes[0]);
    if (counts.width() != input->width || counts.height() != input->height)
      throw Error(fmt::format("this frame is {}x{} pixels, the first one {}x{}", counts.width(),
                              counts.height(), input->width, input->height),
                  input->views[std::size_t(k)].name);
    return counts;
  };
  return frames;
}

}  // namespace polarscan
