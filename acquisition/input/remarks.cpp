// SPDX-License-Identifier: Apache-2.0
#include "acquisition/input/remarks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "acquisition/input/forms/angles.h"
#include "acquisition/input/masks.h"
#include "core/error.h"
#include "core/formats/picture_tags.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

bool IsJpeg(const fs::path& path) {
  const std::string extension = path.extension().string();
  return extension == ".jpg" || extension == ".jpeg" || extension == ".JPG" || extension == ".JPEG";
}

void AddSessionNotes(Input& input) {
  const FrameCounts& counts = input.session->info.counts;
  if (counts.lost + counts.dropped > 0) input.notes.push_back("the session: " + Describe(counts));
  for (const std::string& damage : input.session->damage)
    input.warnings.push_back("the session is damaged: " + damage);
}

void WarnOfAngles(Input& input) {
  const std::vector<double> angles = AnglesNamesMayMean(input.folder);
  if (angles.empty()) return;
  input.warnings.push_back(
      fmt::format("the folders {} may be the angles of a polarizer, and their pictures are taken as plain "
                  "photos: give {} if they are angles, --input-kind photos if not",
                  AnglesText(angles), AnglesOption(angles)));
}

// In what the angles are taken to be where nobody said it, and whether they end long before half a turn.
void SayAopScale(Input& input, const InputOptions& options) {
  if (input.kind != InputKind::kRgbAopDop || options.aop_scale != "auto") return;
  constexpr double kMostOfIt = 0.75;
  const std::size_t step = std::max<std::size_t>(1, input.views.size() / 8);
  double least = 0, most = 0, end = 0;
  bool floating = false;
  for (std::size_t i = 0; i < input.views.size(); i += step) {
    try {
      const Picture aop = ReadPicture(input.views[i].files[1]);
      floating = aop.bits == 32;
      end = floating ? std::numbers::pi : aop.full_scale;
      for (const float value : aop.planes[0].pixels())
        if (std::isfinite(value))
          least = std::min(least, double(value)), most = std::max(most, double(value));
    } catch (const Error&) {  // reading it for good will tell
    }
  }
  if (end == 0) return;
  input.notes.push_back(floating ? "angles of polarization are taken as radians (--aop-scale if they are not)"
                                 : "full scale of aop/ is taken as 180 degrees (--aop-scale if it is not)");
  if (most > kMostOfIt * end || least < 0) return;
  input.warnings.push_back(
      fmt::format("no angle in aop/ is above {:.4g} where half a turn is taken as {:.4g}: are they {}? Give "
                  "--aop-scale {}, or "
                  "{} if they are right",
                  most, end, floating ? "shares of half a turn" : "degrees",
                  floating ? "half-turn" : "degrees", floating ? "radians" : "half-turn"));
}

// Counts that are taken as linear in light though their file says that they are not, or cannot say.
void WarnOfEncoding(Input& input, const InputOptions& options, const Picture& first) {
  const bool counts = !input.session && input.kind != InputKind::kStokes && first.bits < 32;
  if (!counts || input.sensor.gamma != 1 || options.gamma > 0) return;
  const std::vector<fs::path>& files = input.views[0].files;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (!ReadPictureTags(files[i]).encoded) continue;
    const bool is_light = input.kind != InputKind::kRgbAopDop || i == 0;
    return input.warnings.push_back(
        fmt::format("{} says that its values are coded for showing (sRGB, a gamma or a profile), and they "
                    "are taken as they are: {}",
                    files[i].string(),
                    is_light ? "give --gamma 2.2, or --gamma 1 if they are linear in light all the same"
                             : "angles and degrees of polarization must be saved linear"));
  }
  if (first.bits == 8 && input.kind != InputKind::kMosaic && !IsJpeg(files[0]))
    input.notes.push_back(
        "these 8-bit pictures do not say whether they are linear in light; they are taken as such (--gamma "
        "2.2 if they are not)");
}

// Views whose k-th file is one.
auto CountJpegs(const Input& input, std::size_t k) {
  return std::ranges::count_if(input.views, [k](const InputView& view) { return IsJpeg(view.files[k]); });
}

// JPEG keeps blocks of pixels, not single ones.
void WarnOfJpegMosaics(Input& input) {
  if (input.kind != InputKind::kMosaic || input.session) return;
  const auto jpegs = CountJpegs(input, 0);
  if (jpegs > 0)
    input.warnings.push_back(fmt::format(
        "{} of {} raw mosaics are JPEG, which blends neighbouring pixels, here of different polarizers: "
        "polarization is wrong or lost there. Save the camera's pictures as PNG or TIFF",
        jpegs, input.views.size()));
}

}  // namespace

void AddNotes(Input& input, const InputOptions& options, const Picture& first) {
  const auto without = std::ranges::count_if(input.views, [](const InputView& view) { return !view.mask; });
  if (without > 0 && std::size_t(without) < input.views.size())
    input.notes.push_back(fmt::format("{} of {} views have no mask; there the whole picture counts as object",
                                      without, input.views.size()));
  if (!MaskFromAlpha(first).empty())
    input.notes.push_back(without > 0 ? "what is transparent in the pictures counts as their mask"
                                      : "the pictures' transparency is not used, since there are masks");
  if (!input.polarized() && options.kind == "auto") WarnOfAngles(input);
  if (!input.polarized())
    input.notes.push_back("plain photos: no polarization is known, so stereo goes by the intensity alone");
  if (!input.views[0].exposures.empty())
    input.notes.push_back("the views were taken with several exposures, which are merged");
  if (input.session) return AddSessionNotes(input);
  if (input.polarized() && options.gamma <= 0 && IsJpeg(input.views[0].files[0]))
    input.notes.push_back("JPEG pictures are taken as linear in light (--gamma 2.2 if they are not)");
  if (input.kind == InputKind::kRgbAopDop && options.aop_sense == "auto")
    input.notes.push_back(
        "angles of polarization are taken as anticlockwise from +x (--aop-sense clockwise if they are not)");
}

void AddWarnings(Input& input, const InputOptions& options, const Picture& first) {
  WarnOfEncoding(input, options, first);
  WarnOfJpegMosaics(input);
  SayAopScale(input, options);
  if (first.bits == 8 && options.bits > 8 && !input.session)
    input.warnings.push_back(fmt::format(
        "these pictures hold 8 bits, not {} as --bits or set.json says; they are taken as 8 bits. Save "
        "the camera's counts in 16-bit files to keep them all",
        options.bits));
  if (first.bits < 32 && input.sensor.white_dn > double((1 << input.sensor.bits) - 1))
    input.warnings.push_back(fmt::format(
        "no count of these {}-bit pictures reaches the white level {:g}, so all of them come out dark: "
        "check --white-level and set.json",
        input.sensor.bits, input.sensor.white_dn));
  if (input.kind != InputKind::kRgbAopDop) return;
  const auto jpegs = CountJpegs(input, 1);
  if (jpegs > 0)
    input.warnings.push_back(fmt::format(
        "{} of {} pictures in aop/ are JPEG, which blends 0 with 180 degrees and neighbours with each "
        "other: the angles are wrong there. Save them as PNG or TIFF",
        jpegs, input.views.size()));
}

void WarnOfUnusedLayout(Input& input, const InputOptions& given) {
  if (!given.layout.empty() && input.kind != InputKind::kMosaic)
    input.warnings.push_back(fmt::format(
        "--layout is for raw mosaics and not used: these pictures are taken as {}{}", ToString(input.kind),
        input.kind == InputKind::kPhotos ? " (--input-kind mosaic if they are raw mosaics)" : ""));
}

}  // namespace polarscan
