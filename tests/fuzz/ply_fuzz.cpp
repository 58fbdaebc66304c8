// SPDX-License-Identifier: Apache-2.0
#include "apps/check_files.h"
#include "damage_fuzz.h"

using namespace polarscan;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto file = FuzzFolder() / "fuzzed.ply";
  WriteFuzzFile(file, reinterpret_cast<const char*>(data), size);
  return CheckFuzzed([&] { CheckPly(file); });
}
