// SPDX-License-Identifier: Apache-2.0
// `polarscan board` and what a printed board does for a scan, from outside.
#include <gtest/gtest.h>

#include "core/files/files.h"
#include "program.h"
#include "stereo/sfm/model/model.h"

namespace polarscan::test {
namespace {

using nlohmann::json;

// Sum of the distances of all cameras from the first one.
double SizeOf(const SparseModel& model) {
  double sum = 0;
  const Eigen::Vector3d first = model.images.begin()->second.cam_from_world.Center();
  for (const auto& [id, image] : model.images) sum += (image.cam_from_world.Center() - first).norm();
  return sum;
}

TEST(BoardCommand, WritesASheetAndRefusesWhatNoneCanBeMadeOf) {
  const TemporaryFolder folder;
  const std::string file = folder / "board.pdf";
  EXPECT_EQ(RunPolarscan({"board", "-o", file}).exit_code, kDone);
  EXPECT_TRUE(ReadFile(file).starts_with("%PDF-1."));
  EXPECT_EQ(RunPolarscan({"board", "-o", file, "--paper", "A3"}).exit_code,
            kDone);  // its own may be replaced
  WriteFileAtomically(file, "somebody's");
  EXPECT_EQ(RunPolarscan({"board", "-o", file}).exit_code, kFailed);
  EXPECT_EQ(ReadFile(file), "somebody's");
  for (const char* paper : {"A7x", "20x20", "0x100", "1e9x1e9", "nanxnan"})
    EXPECT_NE(RunPolarscan({"board", "-o", folder / "other.pdf", "--paper", paper}).exit_code, kDone)
        << paper;
  EXPECT_FALSE(std::filesystem::exists(folder / "other.pdf"));
}

TEST(BoardCommand, ABoardUnderTheObjectGivesMillimetres) {
  const TemporaryFolder folder;
  const std::string data = folder / "data", scan = folder / "scan";
  const Outcome simulated =
      RunPolarscan({"simulate", "-o", data, "--board", "--rings", "40:6", "--width", "480", "--height", "384",
                    "--samples", "1", "--known-poses", "--seed", "4"});
  ASSERT_EQ(simulated.exit_code, kDone) << simulated.err;
  const Outcome made = RunPolarscan({"reconstruct", data, "-o", scan, "--board", "yes", "--preset", "fast",
                                     "--no-mesh", "--max-image-size", "96", "--fusion-min-views", "1"});
  ASSERT_EQ(made.exit_code, kDone) << made.err;
  const json state = ReadJson(folder.path() / "scan" / "scan.json");
  EXPECT_EQ(state.at("unit"), "mm");
  EXPECT_EQ(state.at("unit_source"), "board");
  EXPECT_LT(state.at("unit_sigma"), 1e-3);
  const double mm = ReadJson(folder.path() / "data" / "truth/board.json").at("mm_per_unit");
  const double found = SizeOf(ReadSparseModel(folder.path() / "scan" / "sfm/model")),
               truth = SizeOf(ReadSparseModel(folder.path() / "data" / "sparse"));
  EXPECT_NEAR(found / truth, mm, 1e-3 * mm);
}

}  // namespace
}  // namespace polarscan::test
