// SPDX-License-Identifier: Apache-2.0
// Files that people or other programs wrote wrongly - settings, poses, the JSON of a scan - are answered in
// words.
#include <map>
#include <nlohmann/json.hpp>

#include "core/files/files.h"
#include "pipeline/checksums.h"
#include "usage.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

TEST_F(Usage, CheckKnowsPosesByTheirFolderAndSaysWhatRepairCannotDo) {
  const fs::path model = fs::path(At("sfm")) / "model";
  WriteFileAtomically(model / "cameras.txt", "1 PINHOLE 64 48 80 80 32 24\n");
  WriteFileAtomically(model / "images.txt", "1 1 0 0 0 0 0 4 1 000.png\n\n");
  WriteFileAtomically(model / "points3D.txt", "");
  WriteFileAtomically(At("sfm/colmap.log"), "");
  const Outcome poses = RunPolarscan({"check", At("sfm")});
  EXPECT_EQ(poses.exit_code, kDone) << poses.err;
  EXPECT_NE(poses.err.find("sparse model: sound"), std::string::npos) << poses.err;

  const fs::path session = At("damaged-session");
  fs::copy(At("session"), session, fs::copy_options::recursive);
  for (const fs::path& file : FilesBelow(session / "segments")) {
    std::string bytes = ReadFile(file);
    bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 1);
    WriteFileAtomically(file, bytes);
  }
  const Outcome repair = RunPolarscan({"check", session.string(), "--repair"});
  EXPECT_EQ(repair.exit_code, kDataLost) << repair.err;
  EXPECT_NE(repair.err.find("damaged frames cannot be made again"), std::string::npos) << repair.err;
}

TEST_F(Usage, AConfigurationFileIsAnsweredWithItsNameAndLine) {
  struct Case {
    std::string text;
    Words answer;
  };
  const std::string file = At("settings.toml");
  const std::vector<Case> all = {
      {"thread = 2\n", {"line 1", "--thread;", "did you mean --threads?"}},
      {"preset = \"fast\"\n", {"line 1", "below the section of its command", "[reconstruct]", "[stereo]"}},
      {"# all\n\n[reconstruct]\npreset = \"fast\"\nmax-image-sise = 3\n",
       {"line 5", "did you mean --max-image-size?"}},
      {"[reconstrukt]\npreset = \"fast\"\n", {"line 1", "did you mean reconstruct?"}},
      {"[calibrate.drak]\n", {"line 1", "did you mean dark?"}},
      {"[reconstruct\n", {"line 1", "]"}},
      {"[reconstruct]\npreset \"fast\"\n", {"line 2", "NAME = VALUE"}},
      {"[reconstruct]\npreset = \"fast\n", {"line 2", "closing quote"}},
      {"[reconstruct]\npreset =\n", {"line 2", "too early"}},
      {"[reconstruct]\nfocal = 1 2\n", {"line 2", "'2'"}},
      {"[reconstruct]\nfocal = [1\n", {"line 2", "]"}},
      {"[reconstruct]\nmesh = maybe\n", {"mesh", "maybe", "true or false", "line 2"}},
      {"[reconstruct]\nmesh = 3\n", {"mesh", "'3'", "true or false", "line 2"}},
      {"[reconstruct]\npreset = [\"fast\", \"best\"]\n", {"--preset", "one value", "line 2"}},
      {"[reconstruct]\nlevels = \"ten\"\n", {"--levels", "whole number", "line 2"}},
      {"[reconstruct]\nlevels = 99\n", {"--levels", "1 to 6", "line 2"}},
      {"[reconstruct]\npreset = \"fastest\"\n", {"--preset", "'fastest'", "line 2"}},
      {"[reconstruct]\nfocal = 1\n[mesh]\n[reconstruct]\nfocal = 2\n", {"line 5", "focal", "line 2"}},
      {std::string("\0\x01\xff = \xfe\n", 7), {"line 1"}},
  };
  for (const Case& c : all) {
    WriteFileAtomically(file, c.text);
    Words answer = c.answer;
    answer.push_back("settings.toml");
    Expect({{"reconstruct", At("pictures"), "-o", At("new"), "--config", file}, kWrongUsage, answer});
  }
  Expect({{"doctor", "--config", At("nowhere.toml")}, kWrongUsage, {"--config", At("nowhere.toml")}});
  Expect({{"doctor", "--config", At("empty")}, kWrongUsage, {"--config", At("empty")}});
}

TEST_F(Usage, AConfigurationFileSetsWhatItSaysAndTheCommandLineGoesBeforeIt) {
  const fs::path file = At("good.toml");
  WriteFileAtomically(file,
                      "\xEF\xBB\xBF# settings\r\nthreads = 1\r\n[mesh]\r\nmesh-depth = 6  # coarse\r\n"
                      "refine = false\r\nfaces = 500\r\n[reconstruct]\r\nlayout = '90 45 / 135 0'\r\n"
                      "views = \"a#b,c\"\r\nevaluate.samples = 5\r\n");
  Expect({{"mesh", At("scan"), "--config", file.string()}, kWrongUsage, {"line 10", "evaluate"}});
  WriteFileAtomically(file,
                      "\xEF\xBB\xBF# settings\r\nthreads = 1\r\n[mesh]\r\nmesh-depth = 6  # coarse\r\n"
                      "refine = false\r\nfaces = 500\r\n[reconstruct]\r\nlayout = '90 45 / 135 0'\r\n"
                      "views = \"a#b,c\"\r\n");
  const Outcome outcome = RunPolarscan({"mesh", At("scan"), "--config", file.string(), "--faces", "400"});
  ASSERT_EQ(outcome.exit_code, kDone) << outcome.err;
  const nlohmann::json options = ReadJson(fs::path(At("scan")) / "scan.json")["options"]["mesh"];
  EXPECT_EQ(options["mesh-depth"], 6);
  EXPECT_EQ(options["refine"], false);
  EXPECT_EQ(options["faces"], 400);
}

// Whatever JSON stands in the place of a scan's files, it is an answer in words.
TEST_F(Usage, ForeignJsonInTheFilesOfAScanIsAnsweredInWords) {
  const TemporaryFolder folder;
  const fs::path scan = folder / "scan";
  fs::copy(At("scan"), scan, fs::copy_options::recursive);
  const Words foreign = {"[]",
                         "{}",
                         "null",
                         "3",
                         "\"text\"",
                         "[{\"stages\": 1}]",
                         "{\"format\": 1, \"views\": 2, \"stages\": {\"mesh\": {\"state\": \"done\"}}}",
                         "{\"stages\": [], \"options\": 3, \"input\": {}}"};
  const std::map<std::string, Words> read_by = {
      {"scan.json", {"report", "check", "mesh", "fuse", "sfm", "stereo", "evaluate"}},
      {"checksums.json", {"report", "check", "mesh"}},
      {"dense/views.json", {"report", "check", "mesh", "fuse", "stereo", "evaluate"}},
      {"evaluation/evaluation.json", {"report", "check"}}};
  for (const auto& [name, commands] : read_by) {
    ASSERT_EQ(
        RunPolarscan({"evaluate", scan.string(), "--truth", At("ball.ply"), "--samples", "1000"}).exit_code,
        kDone);
    const std::string good = ReadFile(scan / name);
    for (const std::string& text : foreign)
      for (const std::string& command : commands) {
        WriteFileAtomically(scan / name, text);
        Words arguments = {command, scan.string(), "--quiet"};
        if (arguments[0] == "evaluate")
          arguments.insert(arguments.end(), {"--truth", At("ball.ply"), "--samples", "1000"});
        if (arguments[0] == "mesh") arguments.push_back("--dry-run");
        const Outcome outcome = RunPolarscan(arguments);
        EXPECT_LE(outcome.exit_code, kDataLost) << name << text << command << outcome.err;
        EXPECT_NE(outcome.exit_code, kWrongUsage) << name << text << command << outcome.err;
        EXPECT_EQ(outcome.err.find("exception"), std::string::npos) << outcome.err;
        EXPECT_EQ(outcome.err.find("fault of polarscan"), std::string::npos)
            << name << text << command << outcome.err;
        EXPECT_EQ(outcome.err.find("A JSON file"), std::string::npos)
            << name << text << command << outcome.err;
      }
    WriteFileAtomically(scan / name, good);
  }
}

}  // namespace
}  // namespace polarscan::test
