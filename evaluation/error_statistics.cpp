// SPDX-License-Identifier: Apache-2.0
#include "evaluation/error_statistics.h"

#include <algorithm>
#include <cmath>

namespace polarscan {

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

std::optional<PixelErrors> SumUpPixels(const std::vector<double>& errors, std::size_t total, double penalty,
                                       const std::vector<double>& thresholds) {
  if (total == 0) return std::nullopt;
  std::vector<double> all(total, penalty);
  for (std::size_t i = 0; i < errors.size(); ++i) all[i] = std::min(errors[i], penalty);
  PixelErrors result;
  for (double t : thresholds) {
    if (!errors.empty()) result.estimated.within[t] = ShareBelow(errors, t);
    result.all.within[t] = ShareBelow(errors, t, total);
  }
  if (!errors.empty()) result.estimated.mean = Mean(errors), result.estimated.median = Percentile(errors, 50);
  result.all.mean = Mean(all), result.all.median = Percentile(all, 50);
  return result;
}

std::optional<DistanceFigures> SumUpDistances(const std::vector<double>& distances, double cap) {
  if (distances.empty()) return std::nullopt;
  double squares = 0;
  for (double d : distances) squares += std::pow(cap > 0 ? std::min(d, cap) : d, 2);
  return DistanceFigures{Mean(distances, cap), Percentile(distances, 50),
                         std::sqrt(squares / double(distances.size())), Percentile(distances, 90)};
}

void ErrorCurve::Add(const std::vector<double>& errors) {
  total_ += errors.size();
  for (double error : errors)
    if (error < end_) ++counts_[std::min(kSteps - 1, std::size_t(error / end_ * double(kSteps)))];
}

std::optional<Curve> ErrorCurve::Shares() const {
  if (total_ == 0) return std::nullopt;
  Curve curve{end_, {0}};
  std::size_t below = 0;
  for (std::size_t count : counts_) curve.shares.push_back(double(below += count) / double(total_));
  return curve;
}

namespace {

// Mean over the items of what `figure` gives of each; none if it gives none of any.
template <class T, class Figure>
std::optional<double> MeanWhere(const std::vector<T>& items, Figure&& figure) {
  double sum = 0;
  std::size_t count = 0;
  for (const T& item : items)
    if (const std::optional<double> value = figure(item)) sum += *value, ++count;
  return count > 0 ? std::optional(sum / double(count)) : std::nullopt;
}

ErrorFigures MeanOf(const std::vector<ErrorFigures>& views) {
  ErrorFigures mean{MeanWhere(views, [](const ErrorFigures& f) { return f.mean; }),
                    MeanWhere(views, [](const ErrorFigures& f) { return f.median; }),
                    {}};
  for (const ErrorFigures& view : views)
    for (const auto& [threshold, unused] : view.within)
      mean.within[threshold] = *MeanWhere(views, [t = threshold](const ErrorFigures& f) {
        const auto share = f.within.find(t);
        return share == f.within.end() ? std::nullopt : std::optional(share->second);
      });
  return mean;
}

std::optional<PixelErrors> MeanOf(const std::vector<MapErrors>& views,
                                  std::optional<PixelErrors> MapErrors::*which) {
  std::vector<ErrorFigures> estimated, all;
  for (const MapErrors& view : views) {
    if (!(view.*which)) continue;
    estimated.push_back((view.*which)->estimated);
    all.push_back((view.*which)->all);
  }
  if (all.empty()) return std::nullopt;
  return PixelErrors{MeanOf(estimated), MeanOf(all)};
}

}  // namespace

MapErrors MeanOf(const std::vector<MapErrors>& views) {
  const auto mean = [&](double MapErrors::*which) {
    return MeanWhere(views, [which](const MapErrors& view) { return std::optional(view.*which); })
        .value_or(0);
  };
  return {mean(&MapErrors::object_pixels), mean(&MapErrors::completeness), mean(&MapErrors::beyond),
          MeanOf(views, &MapErrors::depth), MeanOf(views, &MapErrors::normal_deg)};
}

}  // namespace polarscan
