// SPDX-License-Identifier: Apache-2.0
#include "report/page_text.h"

#include "core/files/files.h"

namespace polarscan {

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

// RFC 4648.
std::string Base64(std::string_view bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (k < count ? std::uint8_t(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[word >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

std::string PaletteBase64(const Palette& palette) {
  std::string bytes;
  for (const Rgb8& c : palette) bytes += {char(c.r), char(c.g), char(c.b)};
  return Base64(bytes);
}

}  // namespace polarscan
