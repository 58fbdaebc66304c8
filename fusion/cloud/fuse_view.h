// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "core/progress.h"
#include "fusion/cloud/fuse.h"
#include "fusion/cloud/maps.h"

namespace polarscan {

// Pixels that are part of a point already, one bit a pixel. They begin no point of their own, but still bear
// witness.
class AbsorbedPixels {
 public:
  explicit AbsorbedPixels(std::size_t views) : views_(views) {}
  void Prepare(int view, const Image<float>& depth) {
    if (views_[std::size_t(view)].empty()) views_[std::size_t(view)].resize(depth.size());
  }
  bool Has(int view, std::size_t pixel) const { return views_[std::size_t(view)][pixel]; }
  void Add(int view, std::size_t pixel) { views_[std::size_t(view)][pixel] = true; }

 private:
  std::vector<std::vector<bool>> views_;
};

// The views asked about a view's pixels.
struct Candidates {
  std::vector<int> views;   // indices into the workspace
  std::vector<int> places;  // of each (fusion/cloud/consistency.h)
  std::vector<std::shared_ptr<const ViewMaps>> maps;
};

using PointSink = std::function<void(const std::vector<CloudPoint>&)>;

// The points that begin in one view, row by row to `sink`. Bands of rows at a time, so that what is absorbed
// need not be remembered for the whole picture; within a band rows in parallel. Points absorb pixels of other
// views only, so the result is that of one row after the other.
void FuseView(const ViewMaps& reference, int view, const Candidates& candidates, int min_views,
              const FusionOptions& options, AbsorbedPixels& absorbed, FusionCounts& counts,
              const PointSink& sink, Progress& progress);

}  // namespace polarscan
