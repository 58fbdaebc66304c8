// SPDX-License-Identifier: Apache-2.0
#include "damage_fuzz.h"
#include "demosaic/calibration/calibration.h"

using namespace polarscan;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  WriteFuzzFile(FuzzFolder() / "calibration.json", reinterpret_cast<const char*>(data), size);
  return CheckFuzzed([] { ReadCalibration(FuzzFolder()); });
}
