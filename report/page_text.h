// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "demosaic/false_colour.h"

namespace polarscan {

// JSON inside of `<script>`: no "<", so that no text can end the script. Bytes that are not UTF-8 are replaced.
std::string EscapeJson(const nlohmann::json& value);

// The template with each {{name}} replaced, in the order given; the inserted texts are not looked at.
std::string Fill(std::string_view page, const std::vector<std::pair<std::string_view, std::string>>& texts);

// RFC 4648.
std::string Base64(std::string_view bytes);

// 256 colours, three bytes each.
std::string PaletteBase64(const Palette& palette);

}  // namespace polarscan
