// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "acquisition/input/input.h"
#include "core/progress.h"
#include "demosaic/doubts.h"
#include "demosaic/method.h"
#include "demosaic/polar_view.h"

namespace polarscan {

// One view of an input, demosaiced where it is a mosaic. Stokes as in docs/conventions.md, whatever the
// source's sense.
PolarView MakeView(const Input& input, const LoadedView& loaded, const DemosaicOptions& options);

// Writes for every view of the input into `folder`:
//   NAME.tif         S0, S1, S2, noise (demosaic/stokes.h)
//   NAME.png         8-bit picture of S0, grey or colour: 255 (S0 / scale)^(1/2.2), one scale for the whole
//                    set, which is the 99.5th percentile of S0 (photos: full scale, so that a photo looks as
//                    before)
//   masks/NAME.png   0 or 255, where the input has a mask
//   pictures/NAME/   angle and degree of polarization and more as pictures, if asked for (view_pictures.h)
// and views.json: {"polarized", "kind", "scale", "views": {NAME: {"hash", "files": {file: hash}}}}. A view is
// kept if its hash (of the input files' bytes and all that decides what they mean) and its files' contents
// are right; files of views that are no longer in the input are removed. May be stopped and called again at
// any time. Memory: at most four views at once. Throws Error on damaged input, Cancelled.
void MakeStokesViews(const Input& input, const std::filesystem::path& folder, const DemosaicOptions& options,
                     Progress& progress, bool pictures = false);

// Views that hold the same picture, in words.
std::vector<std::string> SamePictures(const Input& input, const Progress& progress);

// Gathers what is wrong with views (demosaic/doubts.h), for one sentence a kind of fault.
class ViewFaults {
 public:
  void Add(const std::string& view, const ViewDoubts& doubts);
  std::vector<std::string> Words(const Input& input) const;

 private:
  std::set<std::string> without_light_, impossible_, clipped_, unbalanced_;
};

}  // namespace polarscan
