// SPDX-License-Identifier: Apache-2.0
#include "simulation/gige/features.h"

#include <arpa/inet.h>

#include "core/error.h"

namespace polarscan {
namespace {

using Kind = GigeFeature::Kind;

GigeFeature Enumeration(const std::string& name,
                        const std::vector<std::pair<std::string, std::uint32_t>>& entries) {
  GigeFeature feature{name, Kind::kEnumeration, true};
  feature.entries = entries;
  feature.value = entries.at(0).second;
  return feature;
}

GigeFeature PixelFormats(const GigeSource& source) {
  std::vector<std::pair<std::string, std::uint32_t>> entries;
  for (const std::string& name : source.pixel_formats) {
    const auto code = PixelFormatCode(name);
    if (!code) throw Error("a GigE Vision camera cannot send this pixel format", name);
    entries.emplace_back(name, *code);
  }
  return Enumeration("PixelFormat", entries);
}

GigeFeature Chunks() {
  std::vector<std::pair<std::string, std::uint32_t>> entries;
  for (const GigeChunk& chunk : kGigeChunks) entries.emplace_back(chunk.name, chunk.id);
  return Enumeration("ChunkSelector", entries);
}

}  // namespace

std::vector<GigeFeature> FeaturesOf(const GigeSource& source) {
  const double width = source.width, height = source.height;
  return {
      {"SensorWidth", Kind::kInteger, false, width},
      {"SensorHeight", Kind::kInteger, false, height},
      {"Width", Kind::kInteger, false, width, width, width},
      {"Height", Kind::kInteger, false, height, height, height},
      {"OffsetX", Kind::kInteger, false, 0, 0, 0},
      {"OffsetY", Kind::kInteger, false, 0, 0, 0},
      PixelFormats(source),
      {"PayloadSize", Kind::kInteger, false, 0},
      Enumeration("AcquisitionMode", {{"Continuous", 0}}),
      {"AcquisitionStart", Kind::kCommand},
      {"AcquisitionStop", Kind::kCommand},
      Enumeration("TriggerMode", {{"Off", 0}, {"On", 1}}),
      Enumeration("TriggerSource", {{"Software", 0}}),
      {"TriggerSoftware", Kind::kCommand},
      {"AcquisitionFrameRate", Kind::kFloat, true, source.frames_per_s, 0.01, 10000, "Hz"},
      {"TLParamsLocked", Kind::kInteger, true, 0, 0, 1},
      {"DeviceTemperature", Kind::kFloat, false, 40, -50, 150, "C"},
      {"TimestampTickFrequency", Kind::kInteger, false, 1e9},
      {"ChunkModeActive", Kind::kBoolean, true},
      Chunks(),
      {"ChunkEnable", Kind::kBoolean, true},
  };
}

GigeIdentity IdentityOf(const Camera& source, const in_addr& address) {
  const CameraInfo info = source.info();
  // Several simulated cameras may be there at once; serial numbers tell cameras apart.
  const std::string serial = info.id == "simulated" ? ::inet_ntoa(address) : info.serial;
  GigeIdentity identity{info.vendor, info.model, POLARSCAN_VERSION, serial, {}};
  const std::uint32_t host = ntohl(address.s_addr);
  for (int i = 0; i < 4; ++i) identity.address[std::size_t(i)] = std::uint8_t(host >> (24 - 8 * i));
  return identity;
}

}  // namespace polarscan
