// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <gtest/gtest.h>
#include <linux/capability.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "acquisition/host/system.h"
#include "session_helpers.h"

namespace polarscan::test {

using Checks = std::vector<HostCheck>;

// Made-up /sys, /proc and /dev folders.
class HostTest : public SessionFolder {
 protected:
  HostTest() { host_ = {folder_ / "sys", folder_ / "proc", folder_ / "dev", {folder_ / "rules"}}; }

  static void Put(const std::filesystem::path& path, const std::string& text) {
    std::filesystem::create_directories(path.parent_path());
    Overwrite(path, text + "\n");
  }
  static void Link(const std::filesystem::path& path, const std::filesystem::path& target) {
    std::filesystem::create_directories(path.parent_path());
    std::filesystem::create_symlink(target, path);
  }

  Host host_;
};

// The check whose name ends like this; a check named "(none)" if there is none.
inline HostCheck Find(const Checks& checks, const std::string& end) {
  for (const HostCheck& check : checks)
    if (check.name.ends_with(end)) return check;
  return {"(none)", CheckState::kGood, "", "", ""};
}

inline testing::AssertionResult Is(const HostCheck& check, CheckState state) {
  if (check.name != "(none)" && check.state == state) return testing::AssertionSuccess();
  return testing::AssertionFailure() << ToJson(check).dump(2);
}

// As a user whom the mode of a file stops, which it does not for root.
inline void WithoutPrivileges(const std::function<void()>& f) {
  std::thread([&] {
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    __user_cap_data_struct none[2] = {};
    ASSERT_EQ(::syscall(SYS_capset, &header, none), 0);
    f();
  }).join();
}

}  // namespace polarscan::test
