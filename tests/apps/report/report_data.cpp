// SPDX-License-Identifier: Apache-2.0
#include "report/report_data.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>

#include "core/files/files.h"
#include "program.h"

namespace polarscan::test {
namespace fs = std::filesystem;

std::string Decode(const std::string& base64) {
  std::array<int, 256> digit{};
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < 64; ++i) digit[std::uint8_t(digits[i])] = int(i);
  std::string bytes;
  for (std::size_t i = 0; i + 3 < base64.size(); i += 4) {
    unsigned word = 0;
    for (std::size_t k = 0; k < 4; ++k) word = word << 6 | unsigned(digit[std::uint8_t(base64[i + k])]);
    for (std::size_t k = 0; k < 3; ++k)
      if (base64[i + k + 1] != '=') bytes += char(word >> (16 - 8 * k) & 255);
  }
  return bytes;
}

std::string Inside(const std::string& html, const std::string& id) {
  const std::string tag = "id=\"" + id + "\">";
  const std::size_t begin = html.find(tag) + tag.size();
  return html.substr(begin, html.find("</", begin) - begin);
}

nlohmann::json DataOf(const std::string& html) { return nlohmann::json::parse(Inside(html, "data")); }

std::string Report(const fs::path& scan) {
  const Outcome outcome = RunPolarscan({"report", scan.string()});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  return ReadFile(scan / "report.html");
}

nlohmann::json ReportData(const fs::path& scan) { return DataOf(Report(scan)); }

}  // namespace polarscan::test
