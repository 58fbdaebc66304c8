// SPDX-License-Identifier: Apache-2.0
// A scan made before and run again: what is kept, what is made anew and why, and what is said to be out of
// date.
#include <gtest/gtest.h>

#include "core/files/files.h"
#include "pipeline/pipeline_scan.h"
#include "report/report_data.h"
#include "stereo/sfm/model/model.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

TEST_F(Pipeline, TheSameCommandAgainDoesNothingAndAChangedOptionOnlyWhatDependsOnIt) {
  const fs::path scan = Folder("scan");
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  const auto depth_time = fs::last_write_time(scan / "dense/stereo/depth_maps/000000.png.geometric.bin");
  const auto cloud_time = fs::last_write_time(scan / "cloud.ply");

  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  EXPECT_EQ(fs::last_write_time(scan / "cloud.ply"), cloud_time);

  ASSERT_EQ(RunPolarscan(Command(scan, {"--fusion-reprojection", "0.6"})).exit_code, 0);
  EXPECT_EQ(fs::last_write_time(scan / "dense/stereo/depth_maps/000000.png.geometric.bin"), depth_time);
  EXPECT_GT(fs::last_write_time(scan / "cloud.ply"), cloud_time);
}

TEST_F(Pipeline, ADryRunSaysWhatWouldBeMadeAndWhyAndTouchesNothing) {
  const fs::path scan = Folder("scan");
  EXPECT_EQ(Plan(Command(scan)).at("views"), "it was not made yet");
  EXPECT_FALSE(fs::exists(scan));
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  const auto before = Contents(scan);
  EXPECT_EQ(Plan(Command(scan)), AllDone());

  auto other_fusion = AllDone();
  other_fusion["fusion"] = "fusion-reprojection: 0.8 -> 0.6";
  other_fusion["mesh"] = other_fusion["report"] = "unless stage fusion comes out the same again";
  EXPECT_EQ(Plan(Command(scan, {"--fusion-reprojection", "0.6"})), other_fusion);
  auto other_views = Plan(Command(scan, {"--demosaic", "bilinear"}));
  EXPECT_NE(other_views.at("views").find("-> \"bilinear\""), std::string::npos) << other_views.at("views");
  EXPECT_EQ(other_views.at("stereo"), "unless stage views comes out the same again");
  EXPECT_TRUE(before == Contents(scan));
}

TEST_F(Pipeline, WhatIsWrongWithKnownPosesShowsBeforeAnythingIsMadeAlsoInADryRun) {
  const fs::path input = Folder("input"), images = input / "sparse/0/images.txt";
  fs::copy(Input(), input, fs::copy_options::recursive);
  fs::remove_all(input / "sparse");
  fs::create_directory(input / "sparse");
  fs::copy(Input() / "sparse", input / "sparse/0", fs::copy_options::recursive);
  EXPECT_EQ(Plan(Command(Folder("scan"), {}, input)).at("sfm"), "it was not made yet") << "one folder down";

  SparseModel model = ReadSparseModel(input / "sparse");
  model.images.erase(std::prev(model.images.end()));
  WriteSparseModelText(input / "sparse/0", model);
  const Outcome without = RunPolarscan(Command(Folder("scan"), {"--dry-run"}, input));
  EXPECT_EQ(without.exit_code, kDone);
  EXPECT_NE(without.err.find("7 of 8 views have a known pose; the model has none for 000007"),
            std::string::npos)
      << without.err;

  WriteFileAtomically(images, "1 1 0 0 0 a 0 3 1 000000.png\n");
  for (const std::vector<std::string>& more : {std::vector<std::string>{"--dry-run"}, {}}) {
    const Outcome outcome = RunPolarscan(Command(Folder("scan"), more, input));
    EXPECT_EQ(outcome.exit_code, kFailed);
    EXPECT_NE(outcome.err.find("line 1"), std::string::npos) << outcome.err;
    EXPECT_FALSE(fs::exists(Folder("scan"))) << "nothing was made";
  }
}

TEST_F(Pipeline, AnEarlierStageRemadeByHandMakesTheLaterOnesUndone) {
  const fs::path scan = Folder("scan");
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  ASSERT_EQ(RunPolarscan({"sfm", scan.string(), "--max-image-size", "40"}).exit_code, 0);
  const Outcome fuse = RunPolarscan({"fuse", scan.string()});
  EXPECT_EQ(fuse.exit_code, kFailed);
  EXPECT_NE(fuse.err.find("stage 'stereo' of this scan was made from another result of stage 'dense'"),
            std::string::npos)
      << fuse.err;
}

TEST_F(Pipeline, OneStageRunsAgainWithOtherOptionsAndTheNextOneFollowsIt) {
  const fs::path scan = Folder("scan");
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  const auto before = Results(scan);

  const Outcome stereo = RunPolarscan({"stereo", scan.string(), "--no-filter", "--photometric-iterations",
                                       "1", "--geometric-iterations", "1", "--window-radius", "3",
                                       "--samples", "4", "--sources", "4"});
  ASSERT_EQ(stereo.exit_code, 0) << stereo.err;
  EXPECT_EQ(ReadJson(scan / "scan.json")["options"]["stereo"]["window-radius"], 3);
  EXPECT_TRUE(before.at("cloud.ply") == ReadFile(scan / "cloud.ply")) << "stereo touched the cloud";

  ASSERT_EQ(RunPolarscan({"fuse", scan.string(), "--fusion-min-views", "2"}).exit_code, 0);
  EXPECT_FALSE(before.at("cloud.ply") == ReadFile(scan / "cloud.ply"));

  // The first command again gives the first results again.
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  EXPECT_TRUE(Results(scan) == before);
}

TEST_F(Pipeline, AMeshOfAnEarlierCloudIsNamedAndNotInTheReport) {
  const fs::path scan = Folder("scan");
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  EXPECT_FALSE(DataOf(ReadFile(scan / "report.html")).at("mesh").is_null());
  const Outcome same = RunPolarscan(Command(scan, {"--no-mesh"}));
  EXPECT_EQ(same.err.find("earlier cloud"), std::string::npos) << same.err;

  const Outcome other = RunPolarscan(Command(scan, {"--no-mesh", "--fusion-min-views", "3"}));
  ASSERT_EQ(other.exit_code, 0) << other.err;
  EXPECT_NE(other.err.find("mesh.ply is of an earlier cloud"), std::string::npos) << other.err;
  const json data = DataOf(ReadFile(scan / "report.html"));
  EXPECT_TRUE(data.at("mesh").is_null());
  EXPECT_NE(data.at("notes").dump().find("earlier cloud"), std::string::npos);
  const Outcome check = RunPolarscan({"check", scan.string()});
  EXPECT_EQ(check.exit_code, kDone) << check.err;
  EXPECT_NE(check.err.find("mesh: out of date"), std::string::npos) << check.err;
}

TEST_F(Pipeline, SeveralFoldersMakeOneScanInAnyOrder) {
  const fs::path other = Folder("other"), scan = Folder("scan");
  fs::copy(Input(), other, fs::copy_options::recursive);
  const auto run = [&](const fs::path& a, const fs::path& b) {  // without COLMAP: the views are what matters
    return RunPolarscan({"reconstruct", a.string(), b.string(), "-o", scan.string()}, {{"PATH", "/nowhere"}});
  };
  run(Input(), other);
  const Outcome turned = run(other, Input());
  EXPECT_NE(turned.err.find("views    done before"), std::string::npos) << turned.err;
}

TEST_F(Pipeline, AScanMovedTogetherWithItsInputGoesOn) {
  fs::create_directory(Folder("before"));
  fs::copy(Input(), Folder("before/input"), fs::copy_options::recursive);
  ASSERT_EQ(RunPolarscan(Command(Folder("before/scan"), {}, Folder("before/input"))).exit_code, 0);
  const auto before = Results(Folder("before/scan"));
  fs::rename(Folder("before"), Folder("after"));
  const Outcome outcome = RunPolarscan(Command(Folder("after/scan"), {}, Folder("after/input")));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("stereo   done before"), std::string::npos) << outcome.err;
  EXPECT_TRUE(Results(Folder("after/scan")) == before);
  EXPECT_EQ(ReadJson(Folder("after/scan/scan.json"))["input"], Folder("after/input").string());
  EXPECT_EQ(RunPolarscan({"sfm", Folder("after/scan").string()}).exit_code, 0) << "poses by their old path";
}

TEST_F(Pipeline, AScanCopiedTogetherWithItsInputGoesOnWhileTheOriginalIsThere) {
  fs::create_directories(Folder("first"));
  fs::copy(Input(), Folder("first/pictures"), fs::copy_options::recursive);
  const auto command = [&](const char* where) {
    std::vector<std::string> words = Command(Folder(where) / "scan");
    words[1] = (Folder(where) / "pictures").string();
    return words;
  };
  ASSERT_EQ(RunPolarscan(command("first")).exit_code, 0);
  fs::copy(Folder("first"), Folder("second"), fs::copy_options::recursive);
  const Outcome copy = RunPolarscan(command("second"));
  EXPECT_EQ(copy.exit_code, 0) << copy.err;
  std::vector<std::string> mixed = command("second");
  mixed[1] = (Folder("first") / "pictures").string();
  EXPECT_NE(RunPolarscan(mixed).err.find("a scan of another input"), std::string::npos);
}

// A wrong option costs no result, and what is of earlier maps says so.
TEST_F(Pipeline, AFailedStageLosesNothingAndWhatIsOutOfDateIsNamedEverywhere) {
  const fs::path scan = Folder("scan");
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  const auto says = [](const Outcome& outcome, const std::string& words) {
    EXPECT_NE(outcome.err.find(words), std::string::npos) << words << "\n" << outcome.err;
  };
  EXPECT_EQ(RunPolarscan({"stereo", scan.string(), "--views", "cup*"}).exit_code, kFailed);
  EXPECT_EQ(RunPolarscan({"fuse", scan.string(), "--fusion-maps", "photometric"}).exit_code, kFailed);
  const Outcome whole = RunPolarscan({"check", scan.string()});
  EXPECT_EQ(whole.err.find("out of date"), std::string::npos) << whole.err;
  says(RunPolarscan(Command(scan)), "fusion   done before");
  {
    const Descriptor other = LockFolder(scan, "scan");
    EXPECT_EQ(RunPolarscan({"check", scan.string()}).exit_code, kDone) << "it only looks";
  }
  const std::string truth = (Input() / "truth").string();
  ASSERT_EQ(RunPolarscan({"evaluate", scan.string(), "--truth", truth}).exit_code, kDone);
  ASSERT_EQ(
      RunPolarscan({"stereo", scan.string(), "--preset", "fast", "--window-radius", "3", "--samples", "4"})
          .exit_code,
      kDone);
  says(RunPolarscan({"check", scan.string()}),
       "fusion: out of date, it is of an earlier result of stage stereo");
  ASSERT_EQ(RunPolarscan({"report", scan.string()}).exit_code, kDone);
  const std::string notes = DataOf(ReadFile(scan / "report.html")).at("notes").dump();
  EXPECT_NE(notes.find("The cloud is not of these maps"), std::string::npos) << notes;
  EXPECT_NE(notes.find("The evaluation is of earlier maps"), std::string::npos) << notes;
  says(RunPolarscan({"evaluate", scan.string(), "--truth", truth}), "the cloud is out of date");
}

}  // namespace
}  // namespace polarscan::test
