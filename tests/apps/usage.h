// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <gtest/gtest.h>

#include <string>

#include "program.h"

namespace polarscan::test {

struct WrongUsage {
  Words arguments;
  int exit_code;
  Words answer;  // what the message holds
};

// A scan, a session, pictures and other things, to be given where they do not belong.
class Usage : public testing::Test {
 protected:
  static void SetUpTestSuite();
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }
  static std::string At(const std::string& name) { return (*folder_ / name).string(); }

  // That it is answered so, in words for people, and only on stderr.
  static void Expect(const WrongUsage& wrong);

  static TemporaryFolder* folder_;
};

}  // namespace polarscan::test
