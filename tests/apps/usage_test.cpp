// SPDX-License-Identifier: Apache-2.0
// Wrong usages of every command, through the program as people type them: each is answered by a sentence that
// names what is wrong and what to do, with the right exit code, and nothing goes to stdout.
#include "usage.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/files/files.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

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
      {{"import", At("session"), "-o", At("new")}, kFailed, {"a session already"}},
  };
  for (const WrongUsage& wrong : all) Expect(wrong);
  EXPECT_EQ(ReadFile(At("text.txt")), "no such thing\n");
  EXPECT_FALSE(fs::exists(At("new/scan.json")));
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
    EXPECT_EQ(error.contains("advice"), code == kFailed);
    if (code == kFailed) {
      EXPECT_EQ(error.at("where"), At("pictures"));
    }
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
  const std::string program = RunPolarscan({"--help-all"}).out;  // every command's
  EXPECT_NE(program.find("--window-radius px"), std::string::npos) << program;
  EXPECT_NE(program.find("polarscan calibrate dark"), std::string::npos) << program;
  const std::string stereo = RunPolarscan({"stereo", "--help-all"}).out;
  EXPECT_NE(stereo.find("--window-radius px"), std::string::npos) << stereo;
  EXPECT_NE(stereo.find("(1 to 10; default 5)"), std::string::npos) << stereo;
}

TEST_F(Usage, OldNamesOfOptionsAreUnderstoodAndNotShown) {
  for (const auto& [command, old_name, name] :
       std::vector<std::array<std::string, 3>>{{"mesh", "mesh-close", "mesh-fill-holes"},
                                               {"mesh", "refine-rounds", "refine-iterations"},
                                               {"stereo", "round-turns", "round-iterations"}}) {
    const std::string help = RunPolarscan({command, "--help-all"}).out;
    EXPECT_EQ(help.find("--" + old_name), std::string::npos);
    EXPECT_NE(help.find("--" + name), std::string::npos);
    const auto unlike = RunPolarscan({command, At("scan"), "--" + old_name, "x"});
    EXPECT_EQ(unlike.exit_code, kWrongUsage);
    EXPECT_NE(unlike.err.find("'x'"), std::string::npos) << unlike.err;
    WriteFileAtomically(At("old.toml"), "[" + command + "]\n" + old_name + " = 1e12\n");
    const auto configured = RunPolarscan({"--config", At("old.toml"), command, At("scan")});
    EXPECT_EQ(configured.exit_code, kWrongUsage);
    EXPECT_NE(configured.err.find("1e12"), std::string::npos) << configured.err;
  }
}

TEST_F(Usage, AStderrThatTakesNothingStopsNoWork) {
  for (const char* away : {"2>/dev/full", "2>&-"})
    for (const std::string& words : {std::string("check ") + At("pictures"), std::string("qqqqqqqq")}) {
      const auto run = [&](const std::string& where) {
        return Process({"sh", "-c", std::string(POLARSCAN_PROGRAM) + " " + words + " " + where})
            .Wait()
            .exit_code;
      };
      EXPECT_EQ(run(away), run("2>/dev/null")) << words << " " << away;
    }
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
