// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <vector>

namespace polarscan {

// "0.01", "2.5": the keys under which shares are reported.
std::string ThresholdKey(double threshold);

// Mean of the values in their order; 0 if there are none. With a cap, greater values count as it.
double Mean(const std::vector<double>& values, double cap = 0);
// Linear interpolation between the order statistics, as numpy.percentile. p in [0, 100]; values must not be
// empty.
double Percentile(std::vector<double> values, double p);
// Share of values below the threshold, of `total` (by default of the values themselves).
double ShareBelow(const std::vector<double>& values, double threshold);
double ShareBelow(const std::vector<double>& values, double threshold, std::size_t total);

// Errors at estimated pixels, and `total` pixels that should have been estimated: {mean, median, within:
// {threshold: share}} over the estimated ones, and under over_all the same over all, where a missing pixel
// counts as `penalty` and greater errors are cut to it. Null if total is 0; mean and median are null if
// nothing was estimated.
nlohmann::json PixelErrors(const std::vector<double>& errors, std::size_t total, double penalty,
                           const std::vector<double>& thresholds);

// {mean, median, rms, p90} of distances; a cap > 0 cuts those in mean and rms. Null if there are none.
nlohmann::json DistanceSummary(const std::vector<double>& distances, double cap);

// Cumulative errors: which share lies below 0, 1, ... 100 hundredths of `end`. Errors that are not below
// `end` and those that are infinite (missing) count in the total only.
class ErrorCurve {
 public:
  explicit ErrorCurve(double end) : end_(end) {}
  void Add(const std::vector<double>& errors);
  void AddMissing(std::size_t count) { total_ += count; }
  nlohmann::json ToJson() const;  // {end, shares [101]}; null if nothing was added

 private:
  static constexpr std::size_t kSteps = 100;
  double end_;
  std::array<std::size_t, kSteps> counts_{};
  std::size_t total_ = 0;
};

// Mean of every number over the reports that have it, key by key.
nlohmann::json MeanOf(const std::vector<nlohmann::json>& reports);

}  // namespace polarscan
