// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "program.h"

namespace polarscan::test {

// `polarscan capture` of a small camera, quickly ready.
Words CaptureWords(const std::filesystem::path& session, const Words& more = {});

// Whether the path is there before the process ends.
bool WaitFor(const std::filesystem::path& path, Process& process);

class CaptureProgram : public testing::Test {
 protected:
  std::filesystem::path session() const { return folder_ / "session"; }
  // An address for a GigE camera that no other test has.
  static std::string OwnAddress(int net) {
    return fmt::format("127.{}.{}.{}", net, getpid() / 250 % 250, 1 + getpid() % 250);
  }
  std::filesystem::path segment() const { return session() / "segments" / "000000.seg"; }
  nlohmann::json CheckJson(int expected_code) {
    const Outcome outcome = RunPolarscan({"--json", "check", session().string()});
    EXPECT_EQ(outcome.exit_code, expected_code) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  }
  TemporaryFolder folder_;
};

}  // namespace polarscan::test
