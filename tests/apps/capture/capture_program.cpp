// SPDX-License-Identifier: Apache-2.0
#include "capture/capture_program.h"

#include <chrono>
#include <thread>

namespace polarscan::test {
namespace fs = std::filesystem;

Words CaptureWords(const fs::path& session, const Words& more) {
  Words words = {"capture", "--camera", "simulated", "-o", session.string()};
  for (const char* setting :
       {"width=64", "height=48", "rings=33:3", "samples=1", "scene=sphere", "table=false", "blocks=false"})
    words.insert(words.end(), {"--set", setting});
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

bool WaitFor(const fs::path& path, Process& process) {
  while (process.Running() && !fs::exists(path)) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  return fs::exists(path);
}

}  // namespace polarscan::test
