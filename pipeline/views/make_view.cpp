// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "pipeline/views/views.h"

namespace polarscan {
namespace {

// A colour map of an angle or a degree cannot be read back.
void RequireOneChannel(const Picture& picture, const char* folder, const std::string& where) {
  if (!IsGrey(picture))
    throw Error(
        fmt::format("the picture in {} has colours: it shows the values, it does not hold them", folder),
        where, "Save the values themselves, one channel of 16 bits or floating point");
}

// Values of aop/ in radians, anticlockwise or not as the source has it.
Image<float> AopRadians(const Picture& picture, const std::string& scale, const std::string& where) {
  RequireOneChannel(picture, "aop/", where);
  const bool radians = scale == "radians" || (scale == "auto" && picture.bits == 32);
  const double unit = radians              ? 1
                      : scale == "degrees" ? std::numbers::pi / 180
                                           : std::numbers::pi / picture.full_scale;
  Image<float> aop = picture.planes[0];
  constexpr float kNoRadians = 7;  // more than a turn
  if (radians && std::ranges::any_of(aop.pixels(), [](float value) {
        return std::isfinite(value) && std::abs(value) > kNoRadians;
      }))
    throw Error("angles beyond a whole turn are no radians", where,
                "Give --aop-scale degrees if they are degrees");
  if (scale == "degrees" && picture.bits < 32 &&
      std::ranges::any_of(aop.pixels(), [](float value) { return value > 180; }))
    throw Error("angles of polarization go up to 180 degrees, here are larger ones", where,
                "Give --aop-scale half-turn if full scale is 180 degrees");
  for (float& value : aop.pixels()) value = float(value * unit);
  return aop;
}

Image<float> Dop(const Picture& picture, const std::string& where) {
  RequireOneChannel(picture, "dop/", where);
  Image<float> dop = picture.planes[0];
  for (float& value : dop.pixels()) value /= picture.full_scale;
  return dop;
}

PolarView MakeUnmirrored(const Input& input, const LoadedView& loaded, const DemosaicOptions& options) {
  const std::vector<Picture>& p = loaded.pictures;
  switch (input.kind) {
    case InputKind::kMosaic:
      if (p.size() == 1) CheckMosaic(p[0].planes[0], input.sensor, loaded.name);
      return ViewFromLight(MosaicOf(input, loaded), input.sensor, FindDemosaicMethod(options.method));
    case InputKind::kAngles:
      return input.angles == Input().angles ? ViewFromAngles({&p[0], &p[1], &p[2], &p[3]}, input.sensor)
                                            : ViewFromPolarizer(p, input.angles, input.sensor);
    case InputKind::kStokes:
      return ViewFromStokes({&p[0], &p[1], &p[2]}, p.size() > 3 ? &p[3].planes[0] : nullptr);
    case InputKind::kRgbAopDop:
      return ViewFromAopDop(p[0], AopRadians(p[1], input.aop_scale, loaded.name), Dop(p[2], loaded.name),
                            input.sensor);
    default:
      return ViewFromPhoto(p[0], input.sensor);
  }
}

}  // namespace

PolarView MakeView(const Input& input, const LoadedView& loaded, const DemosaicOptions& options) {
  PolarView view = MakeUnmirrored(input, loaded, options);
  if (input.clockwise) Mirror(view);
  return view;
}

}  // namespace polarscan
