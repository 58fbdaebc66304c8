// SPDX-License-Identifier: Apache-2.0
#include "evaluation/error_statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace polarscan {

std::string ThresholdKey(double threshold) { return fmt::format("{:g}", threshold); }

double Mean(const std::vector<double>& values, double cap) {
  double sum = 0;
  for (double v : values) sum += cap > 0 ? std::min(v, cap) : v;
  return values.empty() ? 0 : sum / double(values.size());
}

double Percentile(std::vector<double> values, double p) {
  const double rank = p / 100 * double(values.size() - 1);
  const auto lower = values.begin() + std::ptrdiff_t(rank);
  std::nth_element(values.begin(), lower, values.end());
  const double low = *lower;
  if (lower + 1 == values.end()) return low;
  const double high = *std::min_element(lower + 1, values.end());
  return low + (rank - std::floor(rank)) * (high - low);
}

double ShareBelow(const std::vector<double>& values, double threshold, std::size_t total) {
  const auto below = std::ranges::count_if(values, [threshold](double v) { return v < threshold; });
  return total == 0 ? 0 : double(below) / double(total);
}

double ShareBelow(const std::vector<double>& values, double threshold) {
  return ShareBelow(values, threshold, values.size());
}

nlohmann::json PixelErrors(const std::vector<double>& errors, std::size_t total, double penalty,
                           const std::vector<double>& thresholds) {
  if (total == 0) return nullptr;
  std::vector<double> all(total, penalty);
  for (std::size_t i = 0; i < errors.size(); ++i) all[i] = std::min(errors[i], penalty);
  nlohmann::json within = nlohmann::json::object(), within_all = within;
  for (double t : thresholds) {
    if (!errors.empty()) within[ThresholdKey(t)] = ShareBelow(errors, t);
    within_all[ThresholdKey(t)] = ShareBelow(errors, t, total);
  }
  nlohmann::json report = {{"mean", nullptr}, {"median", nullptr}, {"within", within}};
  if (!errors.empty()) report["mean"] = Mean(errors), report["median"] = Percentile(errors, 50);
  report["over_all"] = {{"mean", Mean(all)}, {"median", Percentile(all, 50)}, {"within", within_all}};
  return report;
}

nlohmann::json DistanceSummary(const std::vector<double>& distances, double cap) {
  if (distances.empty()) return nullptr;
  double squares = 0;
  for (double d : distances) squares += std::pow(cap > 0 ? std::min(d, cap) : d, 2);
  return {{"mean", Mean(distances, cap)},
          {"median", Percentile(distances, 50)},
          {"rms", std::sqrt(squares / double(distances.size()))},
          {"p90", Percentile(distances, 90)}};
}

void ErrorCurve::Add(const std::vector<double>& errors) {
  total_ += errors.size();
  for (double error : errors)
    if (error < end_) ++counts_[std::min(kSteps - 1, std::size_t(error / end_ * double(kSteps)))];
}

nlohmann::json ErrorCurve::ToJson() const {
  if (total_ == 0) return nullptr;
  std::vector<double> shares = {0};
  std::size_t below = 0;
  for (std::size_t count : counts_) shares.push_back(double(below += count) / double(total_));
  return {{"end", end_}, {"shares", shares}};
}

nlohmann::json MeanOf(const std::vector<nlohmann::json>& reports) {
  std::vector<nlohmann::json> present;
  for (const nlohmann::json& report : reports)
    if (!report.is_null()) present.push_back(report);
  if (present.empty()) return nullptr;
  if (!present[0].is_object()) {
    double sum = 0;
    for (const nlohmann::json& report : present) sum += report.get<double>();
    return sum / double(present.size());
  }
  nlohmann::json mean = nlohmann::json::object();
  for (const nlohmann::json& report : present)
    for (const auto& [key, unused] : report.items()) {
      if (mean.contains(key)) continue;
      std::vector<nlohmann::json> values;
      for (const nlohmann::json& r : present)
        if (r.contains(key)) values.push_back(r.at(key));
      mean[key] = MeanOf(values);
    }
  return mean;
}

}  // namespace polarscan
