// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/pictures.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/formats/image_io.h"
#include "demosaic/false_colour.h"

namespace polarscan {
namespace {

// f of each pixel's response; not a number where it is defect.
template <class F>
Image<float> MapResponses(const ResponseMap& responses, F&& f) {
  Image<float> map(responses.width(), responses.height());
  for (int y = 0; y < map.height(); ++y)
    for (int x = 0; x < map.width(); ++x) {
      const Response r = responses.At(x, y);
      map(x, y) = r.Defect() ? std::numeric_limits<float>::quiet_NaN() : f(r, x, y);
    }
  return map;
}

nlohmann::json WriteHeat(const std::filesystem::path& path, const Image<float>& map) {
  std::vector<float> values(map.pixels().begin(), map.pixels().end());
  std::erase_if(values, [](float value) { return !std::isfinite(value); });
  std::ranges::sort(values);
  const auto at = [&](double share) {
    return values.empty() ? 0.0f : values[std::size_t(share * double(values.size() - 1))];
  };
  const float low = at(0.01), high = std::max(at(0.99), low + 1e-9f);
  const Palette palette = HeatPalette();
  Image<Rgb8> picture(map.width(), map.height(), kNoData);
  for (std::size_t i = 0; i < map.size(); ++i)
    if (std::isfinite(map.pixels()[i]))
      picture.pixels()[i] = ColourAt(palette, (map.pixels()[i] - low) / (high - low));
  WritePng(path, picture);
  return {{"from", low}, {"to", high}};
}

}  // namespace

nlohmann::json WriteCalibrationPictures(const std::filesystem::path& folder,
                                        const PolarizerCalibration& calibration, const Layout& layout) {
  const ResponseMap& map = calibration.responses;
  WriteFloatTiff(folder / "condition.tif", {&calibration.condition});
  WriteFloatTiff(folder / "residual.tif", {&calibration.residual});
  return {{"gain.png", WriteHeat(folder / "gain.png",
                                 MapResponses(map, [](const Response& r, int, int) { return r.Gain(); }))},
          {"diattenuation.png",
           WriteHeat(folder / "diattenuation.png",
                     MapResponses(map, [](const Response& r, int, int) { return r.Diattenuation(); }))},
          {"angle_error.png",
           WriteHeat(folder / "angle_error.png",
                     MapResponses(map, [&](const Response& r, int x,
                                           int y) { return AngleErrorDeg(r, layout.AngleAt(x, y)); }))},
          {"condition.png", WriteHeat(folder / "condition.png", calibration.condition)},
          {"residual.png", WriteHeat(folder / "residual.png", calibration.residual)}};
}

}  // namespace polarscan
