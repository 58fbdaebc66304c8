// SPDX-License-Identifier: Apache-2.0
// Wrong usages of every command, through the program as people type them: each is answered by a sentence that
// names what is wrong and what to do, with the right exit code, and nothing goes to stdout.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "core/files.h"
#include "core/image_io.h"
#include "core/mesh.h"
#include "fusion/cloud/cloud.h"
#include "program.h"
#include "toy_scan.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

using Words = std::vector<std::string>;

struct WrongUsage {
  Words arguments;
  int exit_code;
  Words answer;  // what the message holds
};

// A scan, a session, pictures and other things, to be given where they do not belong.
class Usage : public testing::Test {
 protected:
  static void SetUpTestSuite() {
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
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }
  static std::string At(const std::string& name) { return (*folder_ / name).string(); }

  static void Expect(const WrongUsage& wrong) {
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

  static TemporaryFolder* folder_;
};
TemporaryFolder* Usage::folder_ = nullptr;

TEST_F(Usage, WhatTheCommandLineCannotMeanIsAnsweredWithWhatItCould) {
  const std::string scan = At("scan"), pictures = At("pictures"), none = At("nowhere/at/all");
  const std::vector<WrongUsage> all = {
      {{}, kWrongUsage, {"needs a command", "reconstruct", "--help"}},
      {{"reconstrukt", pictures, "-o", At("new")},
       kWrongUsage,
       {"'reconstrukt'", "did you mean reconstruct?"}},
      {{"qqqqqqqq"}, kWrongUsage, {"'qqqqqqqq'", "reconstruct", "simulate"}},
      {{"calibrate"}, kWrongUsage, {"dark, flat, polarizer"}},
      {{"calibrate", "drak", pictures}, kWrongUsage, {"'drak'", "did you mean dark?"}},
      {{"help", "stero"}, kWrongUsage, {"did you mean stereo?"}},
      {{"stereo", scan, "--windw-radius", "3"},
       kWrongUsage,
       {"--windw-radius", "did you mean --window-radius?"}},
      {{"stereo", scan, "--window-radius=3", "-z"}, kWrongUsage, {"no option -z", "--help-all"}},
      {{"reconstruct", "--thread", "2", pictures}, kWrongUsage, {"did you mean --threads?"}},
      {{"mesh", scan, "--dept", "7"}, kWrongUsage, {"did you mean --"}},
      {{"stereo", scan, "--shard", "1/99999999999"}, kFailed, {"--shard 1/99999999999", "NUMBER/COUNT"}},
      {{"stereo", scan, "--shard", "3/2"}, kFailed, {"--shard 3/2", "from 1/4 to 4/4"}},
      {{"stereo", scan, "--window-radius", "three"},
       kWrongUsage,
       {"--window-radius", "whole number", "'three'"}},
      {{"stereo", scan, "--window-radius", "2.5"}, kWrongUsage, {"whole number", "'2.5'"}},
      {{"stereo", scan, "--window-radius", "99"}, kWrongUsage, {"--window-radius", "99", "1 to 10"}},
      {{"stereo", scan, "--sigma-color", "nan"}, kWrongUsage, {"--sigma-color", "0.01 to 10"}},
      {{"stereo", scan, "--window-radius", "-5"}, kWrongUsage, {"--window-radius", "1 to 10"}},
      {{"stereo", scan, "--preset", "defualt"}, kWrongUsage, {"did you mean default?", "fast"}},
      {{"stereo", scan, "--preset"}, kWrongUsage, {"--preset needs a value"}},
      {{"stereo", scan, "--levels", "2", "--levels", "3"}, kWrongUsage, {"--levels", "more than once"}},
      {{"--threads", "many", "doctor"}, kWrongUsage, {"--threads", "'many'"}},
      {{"doctor", "--seed", "-1"}, kWrongUsage, {"--seed", "0 to 2147483647"}},
      {{"doctor", "--quiet", "--verbose"}, kWrongUsage, {"--quiet", "--verbose"}},
      {{"reconstruct"}, kWrongUsage, {"INPUT", "For example: polarscan reconstruct"}},
      {{"reconstruct", pictures}, kWrongUsage, {"--output", "For example: polarscan reconstruct"}},
      {{"reconstruct", pictures, "two", "-o", At("new")}, kWrongUsage, {"there is no two"}},
      {{"reconstruct", pictures, "two"}, kWrongUsage, {"there is no two", "perhaps -o two is meant"}},
      {{"reconstruct", pictures, scan}, kWrongUsage, {"--output", "perhaps -o " + scan + " is meant"}},
      {{"demosaic", pictures, "two"}, kWrongUsage, {"'two'", "perhaps -o two is meant"}},
      {{"evaluate", At("empty"), "--truth", At("ball.ply")},
       kFailed,
       {"dense/views.json", "polarscan reconstruct", At("empty")}},
      {{"evaluate", scan, "--truth", At("empty")}, kFailed, {"mesh.ply", At("empty")}},
      {{"evaluate", scan, "--truth", At("text.txt")}, kFailed, {"text.txt", "PLY, STL or OBJ"}},
      {{"reconstruct", none, "-o", At("new")}, kWrongUsage, {none, (*folder_).path().string()}},
      {{"reconstruct", At("text.txt"), "-o", At("new")}, kWrongUsage, {"is a file", "folder"}},
      {{"evaluate", scan}, kWrongUsage, {"--truth", "For example: polarscan evaluate"}},
      {{"evaluate", scan, "--truth", none}, kWrongUsage, {"--truth", none}},
      {{"evaluate", scan, "--truth", At("ball.ply"), "--cloud", pictures},
       kWrongUsage,
       {"is a folder", "file"}},
      {{"evaluate", scan, "--truth", At("ball.ply"), "--truth-poses", At("text.txt")},
       kWrongUsage,
       {"is a file"}},
      {{"simulate"}, kWrongUsage, {"-o", "--gige", "For example"}},
      {{"capture"}, kWrongUsage, {"--output SESSION", "For example"}},
      {{"cameras", "all"}, kWrongUsage, {"'all'", "too many"}},
      {{"check"}, kWrongUsage, {"PATH", "For example: polarscan check"}},
      {{"replay", At("text.txt")}, kWrongUsage, {"is a file"}},
      {{"replay", At("session"), "--speed", "0"}, kWrongUsage, {"--speed", "0.001 to 1000"}},
      {{"doctor", "--folder", none}, kWrongUsage, {"--folder", none}},
      {{"report", ""}, kWrongUsage, {"empty"}},
  };
  for (const WrongUsage& wrong : all) Expect(wrong);
}

TEST_F(Usage, WhatIsNotWhatACommandTakesIsNamedWithWhatWouldBe) {
  const std::string scan = At("scan"), pictures = At("pictures"), session = At("session"),
                    empty = At("empty"), layout = "90 45 / 135 0";
  const std::vector<WrongUsage> all = {
      {{"reconstruct", empty, "-o", At("new")}, kFailed, {empty}},
      {{"reconstruct", pictures, "-o", At("text.txt"), "--layout", layout}, kFailed, {At("text.txt")}},
      {{"reconstruct", pictures, "-o", "/proc/new", "--layout", layout}, kFailed, {"/proc/new"}},
      {{"reconstruct", pictures, "-o", At("folder.glb"), "--layout", layout}, kFailed, {"other files", "-o"}},
      {{"demosaic", empty, "-o", At("new")}, kFailed, {empty}},
      {{"demosaic", pictures, "-o", At("text.txt"), "--layout", layout}, kFailed, {At("text.txt")}},
      {{"sfm", pictures}, kFailed, {"no scan", "polarscan reconstruct"}},
      {{"stereo", session}, kFailed, {"no scan", "polarscan reconstruct"}},
      {{"fuse", empty}, kFailed, {"no scan", "polarscan reconstruct"}},
      {{"mesh", pictures}, kFailed, {"no scan", "polarscan reconstruct"}},
      {{"mesh", scan, "-o", At("cup.blend")}, kFailed, {"cup.blend", ".stl"}},
      {{"mesh", scan, "-o", At("folder.glb")}, kFailed, {At("folder.glb")}},
      {{"mesh", scan, "-o", "/proc/cup.ply"}, kFailed, {"/proc/cup.ply"}},
      {{"report", session}, kFailed, {"no scan.json", "polarscan reconstruct"}},
      {{"report", scan, "-o", At("folder.html")}, kFailed, {At("folder.html")}},
      {{"report", scan, "-o", At("text.txt/report.html")}, kFailed, {At("text.txt")}},
      {{"evaluate", scan, "--truth", pictures}, kFailed, {"mesh.ply", pictures}},
      {{"evaluate", scan, "--truth", At("text.txt")}, kFailed, {At("text.txt"), "PLY"}},
      {{"evaluate", scan, "--truth", At("zero.ply")}, kFailed, {At("zero.ply")}},
      {{"evaluate", scan, "--truth", At("zero.stl")}, kFailed, {At("zero.stl")}},
      {{"evaluate", scan, "--truth", At("zero.obj")}, kFailed, {At("zero.obj")}},
      {{"evaluate", scan, "--truth", At("far.ply")}, kFailed, {"do not overlap", "--align"}},
      {{"evaluate", scan, "--truth", At("millimetres.ply")}, kFailed, {"as large as the truth", "--align"}},
      {{"evaluate", scan + "/cloud.ply", "--truth", At("far.ply")}, kFailed, {"do not overlap", "--align"}},
      {{"evaluate", pictures, "--truth", At("ball.ply")}, kFailed, {pictures}},
      {{"evaluate", At("zero.ply"), "--truth", At("ball.ply")}, kFailed, {At("zero.ply")}},
      {{"check", At("text.txt")}, kFailed, {"nothing that polarscan can check", "sessions, scans"}},
      {{"check", empty}, kFailed, {"there are no pictures here"}},
      {{"export", pictures, "-o", At("new")}, kFailed, {pictures}},
      {{"export", session, "-o", At("text.txt")}, kFailed, {At("text.txt")}},
      {{"import", scan, "-o", At("new")}, kFailed, {scan}},
      {{"import", pictures, "-o", session, "--layout", "90 45 / 135 0"}, kFailed, {session}},
      {{"replay", pictures}, kFailed, {pictures}},
      {{"calibrate", "show", pictures}, kFailed, {pictures}},
      {{"calibrate", "dark", empty, "-o", At("new")}, kFailed, {empty}},
      {{"capture", "-o", At("text.txt"), "--camera", "simulated", "--frames", "1"},
       kFailed,
       {At("text.txt")}},
      {{"capture", "-o", At("new"), "--camera", "replay:" + pictures}, kFailed, {pictures}},
      {{"simulate", "-o", At("text.txt"), "--width", "16", "--height", "16"}, kFailed, {At("text.txt")}},
      {{"simulate", "-o", At("new"), "--rings", "many"}, kFailed, {"many"}},
      {{"simulate", "-o", At("new"), "--mesh", At("zero.ply")}, kFailed, {At("zero.ply")}},
      {{"help", "--write", At("text.txt")}, kFailed, {At("text.txt")}},
  };
  for (const WrongUsage& wrong : all) Expect(wrong);
  EXPECT_EQ(ReadFile(At("text.txt")), "no such thing\n");
  EXPECT_FALSE(fs::exists(At("new/scan.json")));
}

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
      {"[reconstruct]\nmesh = maybe\n", {"mesh", "maybe"}},
      {"[reconstruct]\nlevels = \"ten\"\n", {"--levels", "whole number", "line 2"}},
      {"[reconstruct]\nlevels = 99\n", {"--levels", "1 to 6", "line 2"}},
      {"[reconstruct]\npreset = \"fastest\"\n", {"--preset", "'fastest'", "line 2"}},
      {std::string("\0\x01\xff = \xfe\n", 7), {"line 1"}},
  };
  for (const Case& c : all) {
    WriteFileAtomically(file, c.text);
    Words answer = c.answer;
    answer.push_back("settings.toml");
    if (c.text.find("maybe") != std::string::npos) answer.pop_back();
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

TEST_F(Usage, WithJsonErrorsAreOnStdoutTooWithTheSameExitCode) {
  const std::vector<std::pair<Words, int>> all = {
      {{"reconstrukt", "--json"}, kWrongUsage},
      {{"--json", "mesh", At("pictures")}, kFailed},
      {{"mesh", At("scan"), "--faces", "x", "--json"}, kWrongUsage}};
  for (const auto& [arguments, code] : all) {
    const Outcome outcome = RunPolarscan(arguments);
    EXPECT_EQ(outcome.exit_code, code);
    const nlohmann::json error = nlohmann::json::parse(outcome.out).at("error");
    EXPECT_EQ(error.at("exit_code"), code);
    EXPECT_EQ(error.at("kind"), code == kFailed ? "failed" : "wrong usage");
    EXPECT_NE(outcome.err.find(error.at("message").get<std::string>()), std::string::npos) << outcome.err;
  }
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

TEST_F(Usage, HelpShowsWhatPeopleUseFirstAndHelpAllTheRest) {
  const auto lines = [](const std::string& text) { return std::ranges::count(text, '\n'); };
  for (const char* command :
       {"reconstruct", "stereo", "sfm", "mesh", "simulate", "capture", "demosaic", "import"}) {
    const std::string few = RunPolarscan({command, "--help"}).out,
                      all = RunPolarscan({command, "--help-all"}).out;
    EXPECT_LT(lines(few), 50) << few;
    EXPECT_GT(lines(all), lines(few) + 5) << all;
    EXPECT_NE(few.find(std::string("polarscan ") + command + " --help-all"), std::string::npos) << few;
    EXPECT_NE(few.find("Example:\n  polarscan "), std::string::npos) << few;
    EXPECT_EQ(all.find(".14748e+09"), std::string::npos) << all;
    EXPECT_EQ(few, RunPolarscan({"help", command}).out);
  }
  const std::string stereo = RunPolarscan({"stereo", "--help-all"}).out;
  EXPECT_NE(stereo.find("--window-radius px"), std::string::npos) << stereo;
  EXPECT_NE(stereo.find("(1 to 10; default 5)"), std::string::npos) << stereo;
}

TEST_F(Usage, AResultThatStdoutDoesNotTakeIsNoSuccess) {
  for (const Words& words :
       {Words{"doctor", "--json"}, Words{"--help"}, Words{"check", At("session"), "--json"}}) {
    std::string line;
    for (const std::string& word : Polarscan(words)) line += "'" + word + "' ";
    const Outcome outcome = Process({"sh", "-c", line + ">/dev/full"}).Wait();
    EXPECT_EQ(outcome.exit_code, kFailed) << line;
    EXPECT_NE(outcome.err.find("standard output takes no more"), std::string::npos) << line << outcome.err;
  }
}

}  // namespace
}  // namespace polarscan::test
