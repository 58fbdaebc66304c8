// SPDX-License-Identifier: Apache-2.0
#include "apps/page_text.h"

#include "apps/report_util.h"
#include "core/files.h"

namespace polarscan {

std::string EscapeHtml(const std::string& text) {
  std::string escaped;
  for (char c : text) escaped += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
  return escaped;
}

std::string EscapeJson(const nlohmann::json& value) {
  std::string escaped;
  for (char c : ToText(value)) escaped += c == '<' ? "\\u003c" : std::string(1, c);
  return escaped;
}

std::string Fill(std::string_view page, const std::vector<std::pair<std::string_view, std::string>>& texts) {
  std::string filled;
  for (const auto& [name, text] : texts) {
    const std::size_t at = page.find(name);
    filled.append(page.substr(0, at)).append(text);
    page.remove_prefix(at + name.size());
  }
  return filled.append(page);
}

std::string PaletteBase64(const Palette& palette) {
  std::string bytes;
  for (const Rgb8& c : palette) bytes += {char(c.r), char(c.g), char(c.b)};
  return Base64(bytes);
}

}  // namespace polarscan
