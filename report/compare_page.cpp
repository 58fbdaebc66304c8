// SPDX-License-Identifier: Apache-2.0
#include "report/compare_page.h"

#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "demosaic/false_colour.h"
#include "evaluation/output/table.h"
#include "report/page_text.h"
#include "report/pages.h"

namespace polarscan {
namespace {

using nlohmann::json;

constexpr int kJpegQuality = 82;

// {view: {depth: JPEG in base64, normal}}
json ToPage(const std::vector<ErrorPictures>& pictures) {
  json page = json::object();
  for (const ErrorPictures& each : pictures) {
    page[each.view]["depth"] = Base64(EncodeJpeg(each.depth, kJpegQuality));
    if (!each.normal.empty()) page[each.view]["normal"] = Base64(EncodeJpeg(each.normal, kJpegQuality));
  }
  return page;
}

}  // namespace

void WriteComparison(const std::filesystem::path& html, const std::string& truth,
                     const std::vector<NamedEvaluation>& evaluations,
                     const std::vector<std::vector<ErrorPictures>>& pictures) {
  json data = {{"truth", truth},
               {"rows", ComparisonRows(evaluations)},
               {"limits", ToJson(evaluations[0].evaluation).value("pictures", json::object())},
               {"heat", PaletteBase64(HeatPalette())}};
  for (std::size_t i = 0; i < evaluations.size(); ++i)
    data["scans"].push_back({{"name", evaluations[i].name},
                             {"input", evaluations[i].evaluation.input},
                             {"colour", SeriesColour(i)},
                             {"pictures", ToPage(pictures[i])}});
  for (const CurveDrawing& drawing : DrawCurves(evaluations)) data["curves"].push_back(drawing.svg);
  WriteFileAtomically(html, Fill(kCompareHtml, {{"{{style}}", kReportCss}, {"{{data}}", EscapeJson(data)}}));
}

}  // namespace polarscan
