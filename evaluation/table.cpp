// SPDX-License-Identifier: Apache-2.0
#include "evaluation/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace polarscan {
namespace {

using nlohmann::json;
using nlohmann::literals::operator""_json_pointer;

std::string Number(const json& value) {
  return value.is_number() ? fmt::format("{:.4g}", value.get<double>()) : "-";
}
std::string Percent(const json& value) {
  return value.is_number() ? fmt::format("{:.1f} %", 100 * value.get<double>()) : "-";
}

// 1,234,567.
std::string Grouped(std::size_t number) {
  std::string text = std::to_string(number);
  for (std::ptrdiff_t i = std::ptrdiff_t(text.size()) - 3; i > 0; i -= 3) text.insert(std::size_t(i), ",");
  return text;
}

// The keys are numbers; as text they would sort wrongly.
std::vector<std::pair<double, json>> ByThreshold(const json& shares) {
  std::vector<std::pair<double, json>> sorted;
  for (const auto& [key, value] : shares.items()) sorted.emplace_back(std::stod(key), value);
  std::ranges::sort(sorted, {}, &std::pair<double, json>::first);
  return sorted;
}

std::string AlignmentText(const json& a) {
  return fmt::format(
      "Alignment      {} cameras, scale {:.6g}, centres {:.3g} rms ({:.3g} at worst: {}), orientation {:.3g} "
      "deg\n",
      a.at("cameras").get<int>(), a.at("scale").get<double>(), a.at("centre_rms").get<double>(),
      a.at("centre_max").get<double>(), a.at("worst_camera").get<std::string>(),
      a.at("rotation_degrees").get<double>());
}

std::string Errors(const std::string& title, const json& errors) {
  if (errors.is_null()) return "";
  const json& all = errors.at("over_all");
  std::string text = fmt::format("{:<26}{:>12}{:>12}\n", title, "estimated", "all");
  text += fmt::format("  {:<24}{:>12}{:>12}\n", "mean", Number(errors.at("mean")), Number(all.at("mean")));
  text +=
      fmt::format("  {:<24}{:>12}{:>12}\n", "median", Number(errors.at("median")), Number(all.at("median")));
  for (const auto& [threshold, share] : ByThreshold(all.at("within"))) {
    const std::string key = fmt::format("{:g}", threshold);
    text += fmt::format("  {:<24}{:>12}{:>12}\n", "below " + key,
                        Percent(errors.at("within").value(key, json())), Percent(share));
  }
  return text;
}

std::string MapsText(const json& maps) {
  const json& mean = maps.at("mean");
  std::string text = fmt::format(
      "Maps           {} views ({}); {} of the object's pixels estimated; {} of the estimated are off it\n",
      maps.at("views").get<int>(), maps.at("kind").get<std::string>(), Percent(mean.at("completeness")),
      Percent(mean.at("beyond")));
  text += fmt::format("               all: missing pixels count as {:g} and {:g} deg, and no pixel as more\n",
                      maps.at("depth_penalty").get<double>(), maps.at("normal_penalty").get<double>());
  return text + Errors("Depth error", mean.value("depth", json())) +
         Errors("Normal error (deg)", mean.value("normal_degrees", json()));
}

std::string CloudText(const json& cloud) {
  std::string text = fmt::format(
      "Cloud          {} points ({} of the surroundings, {} cropped); {} of the surface counts as visible\n",
      cloud.at("points").get<std::size_t>(), cloud.at("points_of_surroundings").get<std::size_t>(),
      cloud.at("points_cropped").get<std::size_t>(), Percent(cloud.at("visible_share")));
  text += fmt::format("  {:<24}{:>12}{:>12}{:>12}{:>12}\n", "", "mean", "median", "rms", "90 %");
  for (const std::string name : {"accuracy", "completeness"}) {
    const json& d = cloud.at(name);
    if (d.is_null()) continue;
    text += fmt::format("  {:<24}{:>12}{:>12}{:>12}{:>12}\n", name, Number(d.at("mean")),
                        Number(d.at("median")), Number(d.at("rms")), Number(d.at("p90")));
  }
  text += fmt::format("  {:<24}{:>12}{:>12}{:>12}\n", "within", "precision", "recall", "F");
  for (const auto& [threshold, shares] : ByThreshold(cloud.at("thresholds")))
    text +=
        fmt::format("  {:<24}{:>12}{:>12}{:>12}\n", fmt::format("{:g}", threshold),
                    Percent(shares.at("precision")), Percent(shares.at("recall")), Percent(shares.at("F")));
  return text;
}

}  // namespace

std::string EvaluationTable(const json& evaluation) {
  std::string text = "Lengths in the truth's units\n";
  if (evaluation.contains("alignment")) text += AlignmentText(evaluation.at("alignment"));
  if (evaluation.contains("maps")) text += MapsText(evaluation.at("maps"));
  if (evaluation.contains("cloud")) text += CloudText(evaluation.at("cloud"));
  text.pop_back();
  return text;
}

std::vector<std::vector<std::string>> ComparisonRows(const std::vector<NamedEvaluation>& evaluations) {
  const auto unit = [](const json& e) { return e.value("/cloud/unit"_json_pointer, 1.0); };
  std::vector<std::vector<std::string>> rows;
  const auto row = [&](const std::string& label, auto text) {
    rows.push_back({label});
    for (const NamedEvaluation& each : evaluations) rows.back().push_back(text(each.evaluation));
    const auto empty = [](const std::string& cell) { return cell == "-"; };
    if (std::all_of(rows.back().begin() + 1, rows.back().end(), empty)) rows.pop_back();
  };
  const auto at = [](const json& e, const std::string& place) {
    const json::json_pointer pointer(place);
    return e.contains(pointer) ? e.at(pointer) : json();
  };
  row("# of points", [&](const json& e) {
    const json points = at(e, "/cloud/points");
    return points.is_number() ? Grouped(points.get<std::size_t>()) : "-";
  });
  for (const auto& [label, place] :
       {std::pair{"Acc. (x10^-2)", "/cloud/accuracy/mean"}, {"Comp. (x10^-2)", "/cloud/completeness/mean"}})
    row(label, [&, place = place](const json& e) {
      const json mean = at(e, place);
      return mean.is_number() ? fmt::format("{:.3f}", 100 * mean.get<double>() / unit(e)) : "-";
    });
  const json thresholds = at(evaluations[0].evaluation, "/cloud/thresholds");
  for (const auto& [threshold, shares] : ByThreshold(thresholds.is_null() ? json::object() : thresholds)) {
    const std::string place = fmt::format("/cloud/thresholds/{:g}/F", threshold);
    row(fmt::format("F within {:g}", threshold), [&](const json& e) { return Percent(at(e, place)); });
  }
  row("Surface counted", [&](const json& e) { return Percent(at(e, "/cloud/visible_share")); });
  row("Depth error", [&](const json& e) { return Number(at(e, "/maps/mean/depth/over_all/mean")); });
  row("Normal error (deg)",
      [&](const json& e) { return Number(at(e, "/maps/mean/normal_degrees/over_all/mean")); });
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
