// SPDX-License-Identifier: Apache-2.0
// Payloads of every pixel format and size: a picture or an Error, and what was unpacked packs to the same
// samples.
#include <fuzzer/FuzzedDataProvider.h>

#include <cstdlib>

#include "core/error.h"
#include "demosaic/sensor/pixel_format.h"

using namespace polarscan;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider in(data, size);
  static const std::vector<std::string> kFamilies = {"Mono", "BayerRG", "PolarizeMono", "BayerGBPolarized",
                                                     "?"};
  static const std::vector<std::string> kDepths = {"8",   "10",  "12",       "14", "16",
                                                   "10p", "12p", "12Packed", "9"};
  const std::string name = in.PickValueInArray({0, 1, 2, 3, 4}) == 0
                               ? in.ConsumeRandomLengthString(40)
                               : kFamilies[in.ConsumeIntegralInRange<std::size_t>(0, kFamilies.size() - 1)] +
                                     kDepths[in.ConsumeIntegralInRange<std::size_t>(0, kDepths.size() - 1)];
  const auto format = FindPixelFormat(name);
  if (!format) return 0;
  const int width = in.ConsumeIntegralInRange(-2, 70), height = in.ConsumeIntegralInRange(-2, 20);
  const auto stride = std::size_t(in.ConsumeBool() ? 0 : in.ConsumeIntegralInRange(0, 200));
  const auto payload = in.ConsumeRemainingBytes<std::uint8_t>();
  try {
    const Image<std::uint16_t> samples = Unpack(*format, payload, width, height, stride);
    const std::vector<std::uint8_t> packed = Pack(*format, samples);
    const Image<std::uint16_t> again = Unpack(*format, packed, width, height);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const auto mask = std::uint16_t((1u << format->bits) - 1);  // words may hold bits above the format's
      if (again.pixels()[i] != (samples.pixels()[i] & mask)) std::abort();
    }
  } catch (const Error&) {
  }
  return 0;
}
