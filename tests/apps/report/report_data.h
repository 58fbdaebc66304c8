// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace polarscan::test {

// The inverse of base64, RFC 4648.
std::string Decode(const std::string& base64);

// What lies between the tag that holds `id="ID">` and the next "</".
std::string Inside(const std::string& html, const std::string& id);
nlohmann::json DataOf(const std::string& html);

// Runs `polarscan report` on a scan: the page, and its data.
std::string Report(const std::filesystem::path& scan);
nlohmann::json ReportData(const std::filesystem::path& scan);

}  // namespace polarscan::test
