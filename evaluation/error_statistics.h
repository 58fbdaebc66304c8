// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "evaluation/result.h"

namespace polarscan {

// Mean of the values in their order; 0 if there are none. With a cap, greater values count as it.
double Mean(const std::vector<double>& values, double cap = 0);
// Linear interpolation between the order statistics, as numpy.percentile. p in [0, 100]; values must not be
// empty.
double Percentile(std::vector<double> values, double p);
// Share of values below the threshold, of `total` (by default of the values themselves).
double ShareBelow(const std::vector<double>& values, double threshold);
double ShareBelow(const std::vector<double>& values, double threshold, std::size_t total);

// Of the errors at estimated pixels, and of `total` pixels that should have been estimated. None if total is 0.
std::optional<PixelErrors> SumUpPixels(const std::vector<double>& errors, std::size_t total, double penalty,
                                       const std::vector<double>& thresholds);

// A cap > 0 cuts distances in mean and rms. None if there are no distances.
std::optional<DistanceFigures> SumUpDistances(const std::vector<double>& distances, double cap);

// Counts errors for a Curve. Those that are not below `end` and those that are missing count in the total only.
class ErrorCurve {
 public:
  explicit ErrorCurve(double end) : end_(end) {}
  void Add(const std::vector<double>& errors);
  void AddMissing(std::size_t count) { total_ += count; }
  std::optional<Curve> Shares() const;  // none if nothing was added

 private:
  static constexpr std::size_t kSteps = 100;
  double end_;
  std::array<std::size_t, kSteps> counts_{};
  std::size_t total_ = 0;
};

// Of each figure, over the views that have it.
MapErrors MeanOf(const std::vector<MapErrors>& views);

}  // namespace polarscan
