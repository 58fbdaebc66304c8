// SPDX-License-Identifier: Apache-2.0
#include "evaluation/output/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

namespace polarscan {
namespace {

std::string Number(const std::optional<double>& value) { return value ? fmt::format("{:.4g}", *value) : "-"; }
std::string Percent(const std::optional<double>& value) {
  return value ? fmt::format("{:.1f} %", 100 * *value) : "-";
}

// The value at the key; none if there is none.
template <class T>
std::optional<T> At(const std::map<double, T>& values, double key) {
  const auto found = values.find(key);
  return found == values.end() ? std::nullopt : std::optional(found->second);
}

// 1,234,567.
std::string Grouped(std::size_t number) {
  std::string text = std::to_string(number);
  for (std::ptrdiff_t i = std::ptrdiff_t(text.size()) - 3; i > 0; i -= 3) text.insert(std::size_t(i), ",");
  return text;
}

std::string AlignmentText(const AlignmentErrors& e) {
  return fmt::format(
      "Alignment      {} cameras, scale {:.6g}, centres {:.3g} rms ({:.3g} at worst: {}), orientation {:.3g} "
      "deg\n",
      e.cameras, e.scale, e.rms, e.max, e.worst, e.rotation_deg);
}

std::string Errors(const std::string& title, const std::optional<PixelErrors>& errors) {
  if (!errors) return "";
  const ErrorFigures &estimated = errors->estimated, &all = errors->all;
  std::string text = fmt::format("{:<26}{:>12}{:>12}\n", title, "estimated", "all");
  text += fmt::format("  {:<24}{:>12}{:>12}\n", "mean", Number(estimated.mean), Number(all.mean));
  text += fmt::format("  {:<24}{:>12}{:>12}\n", "median", Number(estimated.median), Number(all.median));
  for (const auto& [threshold, share] : all.within)
    text += fmt::format("  {:<24}{:>12}{:>12}\n", fmt::format("below {:g}", threshold),
                        Percent(At(estimated.within, threshold)), Percent(share));
  return text;
}

std::string MapsText(const MapsEvaluation& maps) {
  std::string text = fmt::format(
      "Maps           {} views ({}); {} of the object's pixels estimated; {} of the estimated are off it\n",
      maps.views, maps.kind, Percent(maps.mean.completeness), Percent(maps.mean.beyond));
  text += fmt::format("               all: missing pixels count as {:g} and {:g} deg, and no pixel as more\n",
                      maps.depth_penalty, maps.normal_penalty_deg);
  return text + Errors("Depth error", maps.mean.depth) + Errors("Normal error (deg)", maps.mean.normal_deg);
}

std::string CloudText(const CloudEvaluation& cloud) {
  std::string text = fmt::format(
      "Cloud          {} points ({} of the surroundings, {} cropped); {} of the surface counts as visible\n",
      cloud.points, cloud.points_of_surroundings, cloud.points_cropped, Percent(cloud.visible_share));
  text += fmt::format("  {:<24}{:>12}{:>12}{:>12}{:>12}\n", "", "mean", "median", "rms", "90 %");
  for (const auto& [name, figures] :
       {std::pair{"accuracy", cloud.accuracy}, {"completeness", cloud.completeness}})
    if (figures)
      text += fmt::format("  {:<24}{:>12}{:>12}{:>12}{:>12}\n", name, Number(figures->mean),
                          Number(figures->median), Number(figures->rms), Number(figures->p90));
  text += fmt::format("  {:<24}{:>12}{:>12}{:>12}\n", "within", "precision", "recall", "F");
  for (const auto& [threshold, shares] : cloud.within)
    text += fmt::format("  {:<24}{:>12}{:>12}{:>12}\n", fmt::format("{:g}", threshold),
                        Percent(shares.precision), Percent(shares.recall), Percent(shares.f));
  return text;
}

// Mean distance in hundredths of the unit.
std::string Hundredths(const std::optional<DistanceFigures>& figures, double unit) {
  return figures ? fmt::format("{:.3f}", 100 * figures->mean / unit) : "-";
}

}  // namespace

std::string EvaluationTable(const Evaluation& evaluation) {
  std::string text = "Lengths in the truth's units\n";
  if (evaluation.alignment) text += AlignmentText(*evaluation.alignment);
  if (evaluation.maps) text += MapsText(*evaluation.maps);
  if (evaluation.cloud) text += CloudText(*evaluation.cloud);
  text.pop_back();
  return text;
}

std::vector<std::vector<std::string>> ComparisonRows(const std::vector<NamedEvaluation>& evaluations) {
  std::vector<std::vector<std::string>> rows;
  // One text of each evaluation; no row if none has any.
  const auto row = [&](const std::string& label, auto text) {
    rows.push_back({label});
    for (const NamedEvaluation& each : evaluations) rows.back().push_back(text(each.evaluation));
    const auto empty = [](const std::string& cell) { return cell == "-"; };
    if (std::all_of(rows.back().begin() + 1, rows.back().end(), empty)) rows.pop_back();
  };
  // The same of what is found of the cloud, of the maps' mean errors over all pixels.
  const auto cloud_row = [&](const std::string& label, auto text) {
    row(label, [&](const Evaluation& e) { return e.cloud ? text(*e.cloud) : std::string("-"); });
  };
  const auto maps_row = [&](const std::string& label, std::optional<PixelErrors> MapErrors::*which) {
    row(label, [&](const Evaluation& e) {
      return e.maps && e.maps->mean.*which ? Number((e.maps->mean.*which)->all.mean) : "-";
    });
  };
  cloud_row("# of points", [](const CloudEvaluation& c) { return Grouped(c.points); });
  cloud_row("Acc. (x10^-2)", [](const CloudEvaluation& c) { return Hundredths(c.accuracy, c.unit); });
  cloud_row("Comp. (x10^-2)", [](const CloudEvaluation& c) { return Hundredths(c.completeness, c.unit); });
  if (const auto& first = evaluations[0].evaluation.cloud)
    for (const auto& [threshold, unused] : first->within)
      cloud_row(fmt::format("F within {:g}", threshold), [t = threshold](const CloudEvaluation& c) {
        const auto shares = At(c.within, t);
        return shares ? Percent(shares->f) : "-";
      });
  cloud_row("Surface counted", [](const CloudEvaluation& c) { return Percent(c.visible_share); });
  maps_row("Depth error", &MapErrors::depth);
  maps_row("Normal error (deg)", &MapErrors::normal_deg);
  return rows;
}

std::string ComparisonTable(const std::vector<NamedEvaluation>& evaluations) {
  std::string text = fmt::format("{:<20}", "");
  for (const NamedEvaluation& each : evaluations) text += fmt::format("{:>18}", each.name);
  for (const std::vector<std::string>& row : ComparisonRows(evaluations)) {
    text += fmt::format("\n{:<20}", row[0]);
    for (std::size_t i = 1; i < row.size(); ++i) text += fmt::format("{:>18}", row[i]);
  }
  return text + "\n";
}

}  // namespace polarscan
