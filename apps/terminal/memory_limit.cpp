// SPDX-License-Identifier: Apache-2.0
#include "apps/terminal/memory_limit.h"

#include <malloc.h>
#include <sys/resource.h>
#include <sys/sysinfo.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <string>

namespace polarscan {
namespace {

// "max" and a missing file are no limit.
std::uint64_t ControlGroupBytes() {
  for (const char* path : {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"}) {
    std::uint64_t bytes = 0;
    if (std::ifstream(path) >> bytes && bytes > 0) return bytes;
  }
  return 0;
}

}  // namespace

std::uint64_t MemoryBytes() {
  struct sysinfo info {};
  if (::sysinfo(&info) != 0) return 0;
  const std::uint64_t machine = (std::uint64_t(info.totalram) + info.totalswap) * info.mem_unit;
  const std::uint64_t group = ControlGroupBytes();
  return group > 0 ? std::min(group, machine) : machine;
}

void ReturnFreedMemory() {
#ifdef __GLIBC__
  constexpr int kLarge = 1 << 20;  // bytes. By default glibc raises that to 32 MiB with use
  ::mallopt(M_MMAP_THRESHOLD, kLarge);
#endif
}

void AvoidBlasThreads(char** argv) {
  constexpr const char* kThreads = "OPENBLAS_NUM_THREADS";
  const bool limited = std::ranges::any_of(std::array{RLIMIT_DATA, RLIMIT_AS}, [](auto resource) {
    struct rlimit limit {};
    return ::getrlimit(resource, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY;
  });
  if (!limited || std::getenv(kThreads)) return;
  ::setenv(kThreads, "1", 1);
  ::execv("/proc/self/exe", argv);  // returns only where that cannot be done
}

void LimitMemory() {
#ifdef __SANITIZE_ADDRESS__  // its shadow takes terabytes of addresses
  return;
#endif
  const std::uint64_t bytes = MemoryBytes();
  struct rlimit limit {};
  if (bytes == 0 || ::getrlimit(RLIMIT_DATA, &limit) != 0) return;
  if (limit.rlim_cur != RLIM_INFINITY && limit.rlim_cur <= bytes) return;
  limit.rlim_cur = bytes;
  ::setrlimit(RLIMIT_DATA, &limit);  // where that is refused, all is as it was
}

}  // namespace polarscan
