// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/input/input.h"
#include "acquisition/session/session_reader.h"
#include "core/progress.h"
#include "demosaic/method.h"

namespace polarscan {

// Raw mosaics (an INPUT of that kind) become a session: the counts as Mono or Bayer 8, or as 10, 12, 14 or 16
// in 16-bit words, names kept; masks/ and sparse/ are copied. Returns the number of frames. Throws Error if
// the input is of another kind or the folder is not empty; then nothing is left behind.
std::size_t ImportSession(const Input& input, const std::filesystem::path& folder, Progress& progress);

// The way back: FOLDER/mosaic/NAME.tif or .png with the counts in 16 bits, and FOLDER/set.json, so that the
// folder is an INPUT again. NAME is the view's; a shot of several frames gives NAME-0, NAME-1, ..., and one
// of several exposures exposure-TIME/NAME instead of mosaic/NAME. masks/ and sparse/ come along, the latter
// not where one view becomes several pictures. Returns the number of files. Throws Error if the folder is not
// empty or a frame's pixel format is no raw mosaic.
std::size_t ExportSession(const Session& session, const std::filesystem::path& folder,
                          const std::string& extension, Progress& progress);

// The light behind each polarizer as a picture of its own: FOLDER/I-00/NAME, I-45, I-90, I-135 and set.json,
// an INPUT again. input: raw mosaics or a session of a mono sensor (else Error). Interpolated by the method;
// 16 bits, black at 4096. Returns the number of views.
std::size_t ExportAngles(const Input& input, const DemosaicMethod& method,
                         const std::filesystem::path& folder, const std::string& extension,
                         Progress& progress);

// Raw mosaics as ideal polarizers would show them, black at 4096, 16 bits: FOLDER/mosaic/NAME and set.json,
// an INPUT again. Samples that were clipped and what is above full scale are at 65535. Returns the number of
// views. Throws Error if the input is no raw mosaics or has no calibration, or the folder is not empty.
std::size_t ExportCorrected(const Input& input, const std::filesystem::path& folder,
                            const std::string& extension, Progress& progress);

}  // namespace polarscan
