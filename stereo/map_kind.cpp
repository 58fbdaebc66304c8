// SPDX-License-Identifier: Apache-2.0
#include "stereo/map_kind.h"

#include <fmt/format.h>

#include "core/error.h"

namespace polarscan {

std::string ToString(const MapKind& kind) {
  switch (kind.stage) {
    case MapStage::kPhotometric:
      return "photometric";
    case MapStage::kStep:
      return fmt::format("{}{}", kPassingMaps, kind.number);
    case MapStage::kSeparate:
      return "separate";
    case MapStage::kSurface:
      return fmt::format("{}-surface{}", kPassingMaps, kind.number);
    default:
      return "geometric";
  }
}

MapKind ParseResult(const std::string& name) {
  for (const MapKind& kind : kResults)
    if (ToString(kind) == name) return kind;
  throw Error("there is no such kind of maps", name, "Kinds are geometric and photometric");
}

}  // namespace polarscan
