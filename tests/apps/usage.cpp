// SPDX-License-Identifier: Apache-2.0
#include "usage.h"

#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "core/mesh.h"
#include "toy_scan.h"

namespace polarscan::test {
namespace fs = std::filesystem;

TemporaryFolder* Usage::folder_ = nullptr;

void Usage::SetUpTestSuite() {
  folder_ = new TemporaryFolder;
  WriteToyScan(At("scan"), 3, 64, 48);
  for (int i = 0; i < 3; ++i)
    WritePng(At("pictures/mosaic/0") + std::to_string(i) + ".png", Image<std::uint8_t>(32, 24, 100));
  WriteFileAtomically(At("text.txt"), "no such thing\n");
  for (const char* name : {"zero.ply", "zero.stl", "zero.obj"}) WriteFileAtomically(At(name), "");
  fs::create_directories(At("empty"));
  fs::create_directories(At("folder.html/below"));
  fs::create_directories(At("folder.glb/below"));
  TriangleMesh ball = Ball();
  WriteMesh(At("ball.ply"), ball);
  for (Eigen::Vector3d& v : ball.vertices) v += Eigen::Vector3d(50, 0, 0);
  WriteMesh(At("far.ply"), ball);
  for (Eigen::Vector3d& v : ball.vertices) v = 1000 * (v - Eigen::Vector3d(50, 0, 0));
  WriteMesh(At("millimetres.ply"), ball);
  ASSERT_EQ(
      RunPolarscan({"import", At("pictures"), "-o", At("session"), "--layout", "90 45 / 135 0"}).exit_code,
      kDone);
  ASSERT_EQ(RunPolarscan({"mesh", At("scan"), "--no-refine", "--mesh-depth", "5"}).exit_code, kDone);
}

void Usage::Expect(const WrongUsage& wrong) {
  std::string line = "polarscan";
  for (const std::string& word : wrong.arguments) line += " " + word;
  const Outcome outcome = RunPolarscan(wrong.arguments);
  EXPECT_EQ(outcome.exit_code, wrong.exit_code) << line << "\n" << outcome.err;
  EXPECT_EQ(outcome.out, "") << line;
  for (const std::string& word : wrong.answer)
    EXPECT_NE(outcome.err.find(word), std::string::npos) << line << "\nlacks: " << word << "\n"
                                                         << outcome.err;
  for (const char* internal :
       {"exception", "std::", "filesystem error", "[json", "fault of polarscan", "nan("})
    EXPECT_EQ(outcome.err.find(internal), std::string::npos) << line << "\n" << outcome.err;
}

}  // namespace polarscan::test
