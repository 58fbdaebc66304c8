// SPDX-License-Identifier: Apache-2.0
#include "acquisition/camera/aravis/features.h"

#include <limits>
#include <vector>

#include "acquisition/camera/aravis/glib_objects.h"
#include "core/words.h"

namespace polarscan::aravis {
namespace {

constexpr const char* kLogged[] = {"PixelFormat",
                                   "Width",
                                   "Height",
                                   "OffsetX",
                                   "OffsetY",
                                   "ReverseX",
                                   "ReverseY",
                                   "BinningHorizontal",
                                   "BinningVertical",
                                   "ExposureTime",
                                   "ExposureTimeAbs",
                                   "ExposureAuto",
                                   "Gain",
                                   "GainRaw",
                                   "GainAuto",
                                   "BalanceWhiteAuto",
                                   "BlackLevel",
                                   "BlackLevelRaw",
                                   "Gamma",
                                   "GammaEnable",
                                   "LUTEnable",
                                   "DigitalShift",
                                   "DefectCorrectionEnable",
                                   "SensorName",
                                   "DeviceTemperature",
                                   "AcquisitionFrameRate",
                                   "AcquisitionFrameRateEnable",
                                   "TriggerMode",
                                   "TriggerSource",
                                   "DeviceLinkThroughputLimit",
                                   "DeviceFirmwareVersion",
                                   "DeviceVersion",
                                   "PtpEnable",
                                   "PtpStatus",
                                   "GevSCPSPacketSize",
                                   "GevSCPD"};

// Of this category and those in it.
std::vector<std::string> FeatureNames(ArvDevice* device, const char* category) {
  std::vector<std::string> names;
  ArvGcNode* node = arv_device_get_feature(device, category);
  if (!node || !ARV_IS_GC_CATEGORY(node)) return names;
  for (const GSList* i = arv_gc_category_get_features(ARV_GC_CATEGORY(node)); i; i = i->next) {
    const auto* name = static_cast<const char*>(i->data);
    if (ArvGcNode* feature = arv_device_get_feature(device, name); feature && ARV_IS_GC_CATEGORY(feature)) {
      for (std::string& below : FeatureNames(device, name)) names.push_back(std::move(below));
    } else {
      names.emplace_back(name);
    }
  }
  return names;
}

std::string EntriesOf(ArvGcEnumeration* enumeration) {
  Failure ignored;
  guint count = 0;
  const char** names = arv_gc_enumeration_dup_available_string_values(enumeration, &count, &ignored);
  std::string text;
  for (guint i = 0; i < count; ++i) text += (text.empty() ? "It may be " : ", ") + Text(names[i]);
  g_free(names);
  return text;
}

// "It is Off, On", "From 10 to 20"; empty if the camera does not say.
std::string AllowedValues(ArvDevice* device, const std::string& feature) {
  Failure ignored;
  ArvGcNode* node = arv_device_get_feature(device, feature.c_str());
  if (node && ARV_IS_GC_ENUMERATION(node)) return EntriesOf(ARV_GC_ENUMERATION(node));
  if (node && ARV_IS_GC_BOOLEAN(node)) return "It may be true, false";
  if (node && ARV_IS_GC_FLOAT(node)) {
    double least = 0, most = 0;
    arv_device_get_float_feature_bounds(device, feature.c_str(), &least, &most, &ignored);
    return ignored ? "" : fmt::format("From {:g} to {:g}", least, most);
  }
  if (node && ARV_IS_GC_INTEGER(node)) {
    gint64 least = 0, most = 0;
    arv_device_get_integer_feature_bounds(device, feature.c_str(), &least, &most, &ignored);
    return ignored ? "" : fmt::format("From {} to {}", least, most);
  }
  return "";
}

}  // namespace

bool HasFeature(ArvCamera* camera, const char* feature) {
  Failure ignored;
  return arv_camera_is_feature_available(camera, feature, &ignored);
}

std::string TextFeature(ArvCamera* camera, const char* feature) {
  ArvGcNode* node = arv_device_get_feature(arv_camera_get_device(camera), feature);
  if (!node || !ARV_IS_GC_FEATURE_NODE(node)) return "";
  Failure ignored;
  if (ARV_IS_GC_ENUMERATION(node))
    return Text(arv_gc_enumeration_get_string_value(ARV_GC_ENUMERATION(node), &ignored));
  return Text(arv_gc_feature_node_get_value_as_string(ARV_GC_FEATURE_NODE(node), &ignored));
}

double FloatFeature(ArvCamera* camera, const char* feature) {
  if (!HasFeature(camera, feature)) return std::numeric_limits<double>::quiet_NaN();
  Failure failure;
  const double value = arv_device_get_float_feature_value(arv_camera_get_device(camera), feature, &failure);
  return failure ? std::numeric_limits<double>::quiet_NaN() : value;
}

int IntegerFeature(ArvCamera* camera, const char* feature) {
  Failure failure;
  const gint64 value = arv_device_get_integer_feature_value(arv_camera_get_device(camera), feature, &failure);
  failure.Throw("the camera does not tell this", feature);
  return int(value);
}

nlohmann::json LoggedFeatures(ArvCamera* camera) {
  nlohmann::json values = nlohmann::json::object();
  for (const char* feature : kLogged)
    if (HasFeature(camera, feature)) values[feature] = TextFeature(camera, feature);
  return values;
}

void SetFeature(ArvCamera* camera, const std::string& feature, const std::string& value) {
  ArvDevice* device = arv_camera_get_device(camera);
  if (!HasFeature(camera, feature.c_str())) {
    const std::string nearest = NearestName(feature, FeatureNames(device, "Root"));
    throw Error("the camera has no such feature now", feature,
                (nearest.empty() ? "" : "Did you mean " + nearest + "? ") +
                    "arv-tool-0.8 features lists what it has");
  }
  Failure failure;
  arv_device_set_features_from_string(device, (feature + "=" + value).c_str(), &failure);
  failure.Throw("the camera refuses this value", feature + "=" + value, AllowedValues(device, feature));
}

void SwitchChunksOn(ArvCamera* camera, const std::string& names) {
  if (!arv_camera_are_chunks_available(camera, nullptr))
    throw Error("the camera cannot send values with its pictures (chunk data)", names);
  Failure failure;
  arv_camera_set_chunks(camera, names.c_str(), &failure);
  failure.Throw("the camera refuses to send these values with its pictures", names,
                "arv-tool-0.8 features shows what ChunkSelector knows");
}

}  // namespace polarscan::aravis
