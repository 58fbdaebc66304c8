// SPDX-License-Identifier: Apache-2.0
#include "evaluation/output/plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "core/words.h"

namespace polarscan {
namespace {

constexpr double kWidth = 400, kHeight = 290, kLeft = 46, kRight = 14, kTop = 34, kBottom = 44;

struct Series {
  std::string name, colour;
  bool dashed;
  Curve curve;
};

double X(double share) { return kLeft + share * (kWidth - kLeft - kRight); }
double Y(double share) { return kHeight - kBottom - share * (kHeight - kTop - kBottom); }

std::string Text(double x, double y, const std::string& anchor, const std::string& text) {
  return fmt::format("<text x='{:.1f}' y='{:.1f}' text-anchor='{}'>{}</text>", x, y, anchor,
                     EscapeHtml(text));
}

std::string Axes(const std::string& title, const std::string& x_label, double end) {
  std::string svg =
      fmt::format("<text x='{}' y='18' font-weight='600' font-size='14'>{}</text>", kLeft, EscapeHtml(title));
  for (int i = 0; i <= 4; ++i) {
    const double share = i / 4.;
    svg += fmt::format("<path d='M{0:.1f} {2:.1f}H{1:.1f}' stroke='currentColor' stroke-opacity='{3}'/>",
                       X(0), X(1), Y(share), i == 0 ? 0.8 : 0.15);
    svg += Text(X(0) - 6, Y(share) + 4, "end", fmt::format("{:g} %", 100 * share));
    svg += Text(X(share), Y(0) + 17, "middle", fmt::format("{:.3g}", share * end));
  }
  return svg + Text(X(0.5), kHeight - 8, "middle", x_label);
}

// `end`: of the axis; the curve goes as far as it is known.
std::string Line(const Series& series, double end) {
  const std::vector<double>& shares = series.curve.shares;
  const double last = double(shares.size() - 1);
  std::string path;
  for (std::size_t i = 0; i < shares.size(); ++i)
    path += fmt::format("{}{:.1f} {:.1f}", i ? "L" : "M", X(double(i) / last * series.curve.end / end),
                        Y(shares[i]));
  return fmt::format("<path d='{}' fill='none' stroke='{}' stroke-width='2'{}/>", path, series.colour,
                     series.dashed ? " stroke-dasharray='6 4'" : "");
}

// In the lower right corner, where the curves are high.
std::string Key(const std::vector<Series>& series) {
  std::string svg;
  double y = Y(0) - 10 - 16 * double(series.size() - 1);
  for (const Series& each : series) {
    svg += fmt::format("<path d='M{:.1f} {:.1f}h24' stroke='{}' stroke-width='2'{}/>", X(1) - 26, y - 4,
                       each.colour, each.dashed ? " stroke-dasharray='6 4'" : "");
    svg += Text(X(1) - 32, y, "end", each.name);
    y += 16;
  }
  return svg;
}

std::string Draw(const std::string& title, const std::string& x_label, const std::vector<Series>& series) {
  double end = 0;
  for (const Series& each : series) end = std::max(end, each.curve.end);
  std::string svg = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {0} {1}' width='{0}' height='{1}' "
      "font-family='system-ui,sans-serif' font-size='12' fill='currentColor' role='img'>",
      kWidth, kHeight);
  svg += Axes(title, x_label, end);
  for (const Series& each : series) svg += Line(each, end);
  const bool named = series.size() > 1 || !series[0].name.empty();
  return svg + (named ? Key(series) : "") + "</svg>\n";
}

// A curve of each evaluation that has it: `part` of it (maps, cloud) and there `which`.
template <class Part>
void Add(const std::vector<NamedEvaluation>& evaluations, std::optional<Part> Evaluation::*part,
         std::optional<Curve> Part::*which, const std::string& what, bool dashed,
         std::vector<Series>& series) {
  for (std::size_t i = 0; i < evaluations.size(); ++i) {
    const std::optional<Part>& found = evaluations[i].evaluation.*part;
    if (!found || !((*found).*which)) continue;
    const std::string& name = evaluations[i].name;
    const std::string both = name.empty() || what.empty() ? name + what : name + ", " + what;
    series.push_back({both, SeriesColour(i), dashed, *((*found).*which)});
  }
}

}  // namespace

std::string SeriesColour(std::size_t index) {
  static constexpr const char* kColours[] = {"#2f6fd6", "#d0662a", "#2e8b57",
                                             "#9a4fb0", "#b8860b", "#c7405f"};
  return kColours[index % std::size(kColours)];
}

std::vector<CurveDrawing> DrawCurves(const std::vector<NamedEvaluation>& evaluations) {
  std::vector<CurveDrawing> drawings;
  const auto draw = [&](const char* key, const char* title, const char* x_label,
                        const std::vector<Series>& series) {
    if (!series.empty()) drawings.push_back({key, Draw(title, x_label, series)});
  };
  std::vector<Series> depth, normals, cloud;
  Add(evaluations, &Evaluation::maps, &MapsEvaluation::depth, "", false, depth);
  Add(evaluations, &Evaluation::maps, &MapsEvaluation::normal_deg, "", false, normals);
  Add(evaluations, &Evaluation::cloud, &CloudEvaluation::accuracy_curve, "accuracy", false, cloud);
  Add(evaluations, &Evaluation::cloud, &CloudEvaluation::completeness_curve, "completeness", true, cloud);
  draw("depth", "Depth: pixels with a smaller error", "depth error (units of the truth)", depth);
  draw("normals", "Normals: pixels with a smaller error", "normal error (degrees)", normals);
  draw("cloud", "Cloud: points and surface nearer than", "distance (units of the truth)", cloud);
  return drawings;
}

}  // namespace polarscan
