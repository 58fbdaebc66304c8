// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/polarizer/polarizer_options.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>

#include "core/error.h"

namespace polarscan {
namespace {

std::optional<double> NumberOf(const std::string& text) {
  double value = 0;
  const char* end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, value);
  if (text.empty() || error != std::errc() || at != end) return std::nullopt;
  return value;
}

[[noreturn]] void ThrowBadAngles(const std::string& text) {
  throw Error("these are no angles", fmt::format("--angles {}", text),
              "Give unknown, names (the last number in each frame's name), FIRST:STEP as 0:10, or a list as "
              "0,10,20,35");
}

// The last number in a name: 30 of "angle_030", 7.5 of "p-7.5".
double AngleInName(const std::string& name) {
  const std::size_t last = name.find_last_of("0123456789");
  if (last == std::string::npos)
    throw Error("there is no angle in this frame's name", name, "Names like angle_030, or --angles unknown");
  std::size_t first = last;
  const auto belongs = [](char c) { return (c >= '0' && c <= '9') || c == '.'; };
  while (first > 0 && belongs(name[first - 1])) --first;
  while (name[first] == '.') ++first;
  return NumberOf(name.substr(first, last + 1 - first)).value_or(0);
}

std::vector<double> EvenSteps(const std::string& text, std::size_t colon, std::size_t count) {
  const std::optional<double> first = NumberOf(text.substr(0, colon)),
                              step = NumberOf(text.substr(colon + 1));
  if (!first || !step) ThrowBadAngles(text);
  std::vector<double> angles;
  for (std::size_t k = 0; k < count; ++k) angles.push_back(*first + double(k) * *step);
  return angles;
}

std::vector<double> List(const std::string& text) {
  std::vector<double> angles;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::optional<double> angle = NumberOf(text.substr(begin, end - begin));
    if (!angle) ThrowBadAngles(text);
    angles.push_back(*angle);
    begin = end + 1;
  }
  return angles;
}

std::vector<double> ParseAngles(const std::string& text, const std::vector<std::string>& names) {
  if (text != "names") {
    const std::size_t colon = text.find(':');
    return colon == std::string::npos ? List(text) : EvenSteps(text, colon, names.size());
  }
  std::vector<double> angles;
  for (const std::string& name : names) angles.push_back(AngleInName(name));
  return angles;
}

}  // namespace

OptionTable Table(PolarizerOptions& o) {
  return {
      {.name = "angles",
       .value = &o.angles,
       .help = "The polarizer's angles in the order of the frames' names, in degrees, anticlockwise as "
               "displayed: unknown, names (the last number in each name), FIRST:STEP as 0:10, or a list as "
               "0,10,20,35"},
      {.name = "zero",
       .value = &o.zero,
       .help = "Where angles count from: sensor: where its polarizers are right in the mean; given: as in "
               "--angles, then their zero must be the picture's +x",
       .choices = {"sensor", "given"}},
      {.name = "polarizer-degree",
       .value = &o.degree,
       .help = "Degree of polarization of the light behind the polarizer",
       .min = 0.5,
       .max = 1},
      {.name = "shading",
       .value = &o.shading,
       .help = "Count uneven brightness over the picture as the pixels' gain (the light is even)"},
  };
}

PolarizerKnowledge KnowledgeOf(const PolarizerOptions& options, const std::vector<std::string>& names) {
  PolarizerKnowledge known{.angles_deg = {}, .degree = options.degree, .frames = names};
  known.zero_is_known = options.zero == "given";
  if (options.angles == "unknown") {
    if (known.zero_is_known)
      throw Error("unknown angles have no zero", "--zero given", "Give the --angles as well");
    return known;
  }
  known.angles_deg = ParseAngles(options.angles, names);
  if (known.angles_deg->size() != names.size())
    throw Error(fmt::format("{} angles are given for {} frames", known.angles_deg->size(), names.size()),
                fmt::format("--angles {}", options.angles));
  return known;
}

}  // namespace polarscan
