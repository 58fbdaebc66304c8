// SPDX-License-Identifier: Apache-2.0
// A sparse model of three files, whose lengths are the first bytes of the input; binary or text.
#include "apps/check_files.h"
#include "damage_fuzz.h"

#include <fuzzer/FuzzedDataProvider.h>

using namespace polarscan;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider in(data, size);
  const bool binary = in.ConsumeBool();
  std::filesystem::remove_all(FuzzFolder());
  std::filesystem::create_directories(FuzzFolder());
  for (const char* name : {"cameras", "images", "points3D"}) {
    const std::string bytes = std::string(name) == "points3D" ? in.ConsumeRemainingBytesAsString()
                                                               : in.ConsumeRandomLengthString(4096);
    WriteFuzzFile(FuzzFolder() / (std::string(name) + (binary ? ".bin" : ".txt")), bytes.data(), bytes.size());
  }
  return CheckFuzzed([] { CheckModel(FuzzFolder()); });
}
