// SPDX-License-Identifier: Apache-2.0
// The preview of a recording: what it answers, and what headless Chromium makes of its page.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <httplib.h>
#undef _res  // a macro of <resolv.h> that Eigen stumbles over

#include <thread>

#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "program.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

const httplib::Headers kFromThePage = {{"X-Polarscan", "1"}};

class PreviewPage : public testing::Test {
 protected:
  PreviewPage()
      : port_(20000 + getpid() % 20000),
        client_("127.0.0.1", port_),
        capture_(Polarscan({"capture",          "--camera",       "simulated",          "-o",
                            session().string(), "--set",          "width=240",          "--set",
                            "height=200",       "--set",          "rings=33:2",         "--set",
                            "light=overcast",   "--set",          "samples=1",          "--set",
                            "fps=20",           "--layout",       "90 45 / 135 0",      "--on-key",
                            "--preview",        "--preview-port", std::to_string(port_)})) {
    for (int i = 0; i < 600 && State().value("picture", 0) == 0; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  fs::path session() const { return folder_ / "session"; }

  nlohmann::json State() {
    const httplib::Result answer = client_.Get("/state");
    return answer ? nlohmann::json::parse(answer->body) : nlohmann::json::object();
  }
  int Press(const char* path, const httplib::Headers& headers) {
    const httplib::Result answer = client_.Post(path, headers, "", "text/plain");
    return answer ? answer->status : 0;
  }
  // Until a shot is stored.
  void TakeShot() {
    EXPECT_EQ(Press("/shot", kFromThePage), 200);
    for (int i = 0; i < 100 && State()["counts"]["stored"] != 1; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }

  TemporaryFolder folder_;
  int port_;
  httplib::Client client_;
  Process capture_;
};

TEST_F(PreviewPage, ShowsTheLatestFrameTakesShotsAndEndsTheRecording) {
  for (const char* name : {"/s0.jpg", "/dop.jpg", "/aop.jpg", "/wheel.jpg"}) {
    const httplib::Result answer = client_.Get(name);
    ASSERT_TRUE(answer) << name;
    EXPECT_EQ(answer->get_header_value("Content-Type"), "image/jpeg");
    WriteFileAtomically(folder_ / "picture.jpg", answer->body);
    EXPECT_GT(ReadPicture(folder_ / "picture.jpg").width(), 90) << name;
  }
  EXPECT_EQ(State()["counts"]["stored"], 0);
  EXPECT_EQ(Press("/shot", {}), 403);  // as another site's page would send it
  TakeShot();
  EXPECT_EQ(State()["counts"]["stored"], 1);
  EXPECT_EQ(Press("/stop", kFromThePage), 200);
  EXPECT_EQ(capture_.Wait(30).exit_code, 0);
  EXPECT_EQ(RunPolarscan({"check", session().string()}).exit_code, 0);
}

TEST_F(PreviewPage, AnswersOnThisMachineOnly) {
  for (const char* address : {"127.0.0.2", "127.1.2.3"}) {
    httplib::Client other(address, port_);
    EXPECT_FALSE(other.Get("/state")) << address;
  }
  const Outcome second =
      RunPolarscan({"capture", "--camera", "simulated", "-o", (folder_ / "second").string(), "--set",
                    "width=64", "--set", "height=48", "--preview", "--preview-port", std::to_string(port_)});
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_NE(second.err.find("--preview-port"), std::string::npos) << second.err;
  Press("/stop", kFromThePage);
}

TEST_F(PreviewPage, LooksRightInChromium) {
  if (!HasProgram("chromium")) {
    Press("/stop", kFromThePage);
    GTEST_SKIP() << "chromium is not installed";
  }
  TakeShot();
  const fs::path shot = folder_ / "shot.png";
  const Outcome page =
      Process({"chromium", "--headless", "--no-sandbox", "--hide-scrollbars", "--virtual-time-budget=3000",
               "--user-data-dir=" + (folder_ / "profile").string(), "--enable-logging=stderr", "--v=0",
               "--window-size=1400,900", "--screenshot=" + shot.string(), "--dump-dom",
               fmt::format("http://127.0.0.1:{}/", port_)})
          .Wait(140);
  Press("/stop", kFromThePage);
  EXPECT_EQ(page.err.find("CONSOLE"), std::string::npos) << page.err;
  EXPECT_NE(page.out.find("<dd id=\"stored\">1</dd>"), std::string::npos) << page.out;
  EXPECT_NE(page.out.find("<dd id=\"gone\">0 · 0</dd>"), std::string::npos) << page.out;
  // The angle picture is the only one with saturated colours over much of its place.
  const Picture picture = ReadPicture(shot);
  int colourful = 0, all = 0;
  for (int y = 250; y < 500; ++y)
    for (int x = 960; x < 1340; ++x, ++all) {
      const auto [low, high] =
          std::minmax({picture.planes[0](x, y), picture.planes[1](x, y), picture.planes[2](x, y)});
      colourful += high - low > 60;
    }
  EXPECT_GT(colourful, all / 10);
}

}  // namespace
}  // namespace polarscan::test
