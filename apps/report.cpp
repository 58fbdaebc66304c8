// SPDX-License-Identifier: Apache-2.0
#include "apps/report.h"

#include <fmt/format.h>

#include <utility>

#include "apps/pages.h"
#include "apps/report_cloud.h"
#include "apps/report_util.h"
#include "apps/report_views.h"
#include "core/error.h"
#include "core/files.h"
#include "core/image_io.h"
#include "demosaic/false_colour.h"

namespace fs = std::filesystem;
using nlohmann::json;

namespace polarscan {
namespace {

constexpr std::size_t kMostPoints = 400'000;
constexpr int kLegendSize = 256;

// Text inside of <title>.
std::string EscapeHtml(const std::string& text) {
  std::string escaped;
  for (char c : text) escaped += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
  return escaped;
}

// JSON inside of <script>: no "<", so that no text can end the script. Bytes that are not UTF-8 are replaced.
std::string EscapeJson(const json& value) {
  std::string escaped;
  for (char c : value.dump(-1, ' ', false, json::error_handler_t::replace))
    escaped += c == '<' ? "\\u003c" : std::string(1, c);
  return escaped;
}

// The template with each {{name}} replaced, in the order given; the inserted texts are not looked at.
std::string Fill(std::string_view page, const std::vector<std::pair<std::string_view, std::string>>& texts) {
  std::string filled;
  for (const auto& [name, text] : texts) {
    const std::size_t at = page.find(name);
    filled.append(page.substr(0, at)).append(text);
    page.remove_prefix(at + name.size());
  }
  return filled.append(page);
}

std::string ToBase64(const Palette& palette) {
  std::string bytes;
  for (const Rgb8& c : palette) bytes += {char(c.r), char(c.g), char(c.b)};
  return Base64(bytes);
}

json Legends() {
  return {{"heat", ToBase64(HeatPalette())},
          {"ramp", ToBase64(RampPalette())},
          {"wheel", Base64(EncodeJpeg(AopWheel(kLegendSize), 92))},
          {"ball", Base64(EncodeJpeg(NormalBall(kLegendSize), 92))}};
}

// The cloud, or why there is none in `notes`.
ReportCloud TryPackCloud(const fs::path& ply, const ReportViews& views, json& notes) {
  if (!fs::exists(ply)) {
    notes.push_back("There is no cloud yet.");
    return {};
  }
  try {
    return PackCloud(ply, kMostPoints, views.dop_full, views.display_from_world);
  } catch (const Error& error) {
    notes.push_back(error.what());
    return {};
  }
}

std::string NameOf(const fs::path& folder) {
  const fs::path clean = fs::absolute(folder).lexically_normal();
  return (clean.has_filename() ? clean : clean.parent_path()).filename().string();
}

}  // namespace

void WriteReport(const fs::path& scan_folder, const fs::path& html, Progress& progress) {
  if (!fs::exists(scan_folder / "scan.json"))
    throw Error("not a scan folder (no scan.json)", scan_folder.string(),
                "Give the folder that `polarscan reconstruct INPUT -o SCAN` made");
  json data = {
      {"name", NameOf(scan_folder)}, {"scan", ReadJson(scan_folder / "scan.json")}, {"legends", Legends()}};
  ReportViews views = CollectViews(scan_folder, progress);
  data["notes"] = views.notes;
  ReportCloud cloud = TryPackCloud(scan_folder / "cloud.ply", views, data["notes"]);
  progress.Check();
  data["views"] = std::move(views.views);
  data["dop_full"] = views.dop_full;
  data["cloud"] = cloud.facts;
  WriteFileAtomically(html,
                      Fill(kReportHtml, {{"{{title}}", EscapeHtml(NameOf(scan_folder))},
                                         {"{{style}}", kReportCss},
                                         {"{{data}}", EscapeJson(data)},
                                         {"{{cloud}}", Base64(cloud.bytes)},
                                         {"{{scripts}}", std::string(kReportViewerJs) + kReportPageJs}}));
}

}  // namespace polarscan
