// SPDX-License-Identifier: Apache-2.0
// views.json of a dense workspace, without the files that it names.
#include "apps/check_files.h"
#include "damage_fuzz.h"

using namespace polarscan;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  WriteFuzzFile(FuzzFolder() / "views.json", reinterpret_cast<const char*>(data), size);
  return CheckFuzzed([] { CheckWorkspace(FuzzFolder()); });
}
