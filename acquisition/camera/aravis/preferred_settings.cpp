// SPDX-License-Identifier: Apache-2.0
#include "acquisition/camera/aravis/preferred_settings.h"

#include <algorithm>
#include <cstdlib>

#include "acquisition/camera/aravis/features.h"
#include "acquisition/camera/aravis/glib_objects.h"
#include "demosaic/sensor/pixel_format.h"

namespace polarscan::aravis {
namespace {

// A value of the camera's that the user has not asked for.
void Prefer(const PreferredSettings& settings, const char* feature, const std::string& value,
            const std::string& why) {
  if (settings.is_set(feature) || !HasFeature(settings.camera, feature)) return;
  const std::string before = TextFeature(settings.camera, feature);
  if (before == value) return;
  Failure failure;
  arv_device_set_features_from_string(arv_camera_get_device(settings.camera),
                                      fmt::format("{}={}", feature, value).c_str(), &failure);
  if (failure) {
    settings.progress.Warn(fmt::format("{} is {} and cannot be set to {}: {}", feature, before, value, why));
  } else {
    settings.progress.Info(fmt::format("{} set from {} to {}: {}", feature, before, value, why));
  }
}

}  // namespace

void ChoosePixelFormat(const PreferredSettings& settings, const std::string& model) {
  if (settings.is_set("PixelFormat")) return;
  guint count = 0;
  const char** names = arv_camera_dup_available_pixel_formats_as_strings(settings.camera, &count, nullptr);
  std::string best;
  int best_rank = -1;
  for (guint i = 0; i < count; ++i)
    if (const auto format = FindPixelFormat(names[i])) {
      // The most bits that sensors have (12), in the fewest bytes.
      const int rank = 4 * std::min(format->bits, 12) + (format->packing == Packing::kWords ? 0 : 1);
      if (rank > best_rank) best = names[i], best_rank = rank;
    }
  g_free(names);
  if (best.empty())
    throw Error("the camera offers no raw mosaic", model,
                "Look for a raw or polarized raw mode in its settings");
  Prefer(settings, "PixelFormat", best, "the deepest raw format");
}

void SwitchAutomaticOff(const PreferredSettings& settings) {
  for (const char* feature : {"ExposureAuto", "GainAuto", "BalanceWhiteAuto", "BlackLevelAuto"})
    Prefer(settings, feature, "Off", "pictures of one set must be taken alike");
  for (const char* feature : {"GammaEnable", "LUTEnable"})
    Prefer(settings, feature, "false", "pictures must be linear in light");
  if (HasFeature(settings.camera, "Gamma") && TextFeature(settings.camera, "GammaEnable") != "false")
    Prefer(settings, "Gamma", "1", "pictures must be linear in light");
}

void RefuseWhatChangesTheLayout(ArvCamera* camera) {
  for (const char* feature : {"OffsetX", "OffsetY"})
    if (HasFeature(camera, feature) && std::atoll(TextFeature(camera, feature).c_str()) % 2 != 0)
      throw Error(
          "an odd offset changes the polarizer layout",
          fmt::format("{}={}", feature, TextFeature(camera, feature)),
          fmt::format("Use --set {}={}", feature, std::atoll(TextFeature(camera, feature).c_str()) + 1));
  for (const char* feature : {"ReverseX", "ReverseY"})
    if (TextFeature(camera, feature) == "true")
      throw Error("mirrored pictures turn the angles of polarization round", feature,
                  fmt::format("Use --set {}=false", feature));
}

}  // namespace polarscan::aravis
