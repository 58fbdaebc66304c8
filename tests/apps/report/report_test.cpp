// SPDX-License-Identifier: Apache-2.0
// The report's page, from outside: what its data say.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>

#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "core/mesh.h"
#include "fusion/cloud/cloud.h"
#include "program.h"
#include "report/report_data.h"
#include "stereo/map_io.h"
#include "tests/fusion/sphere_scene.h"
#include "toy_scan.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

TEST(Report, IsOneFileThatNeedsNoOther) {
  TemporaryFolder folder;
  WriteToyScan(folder / "scan", 3);
  std::string html = Report(folder / "scan");
  EXPECT_LT(html.size(), 30'000'000u);
  const std::string xml_namespace = "http://www.w3.org/2000/svg";  // a name that nothing is loaded from
  for (std::size_t at; (at = html.find(xml_namespace)) != std::string::npos;)
    html.erase(at, xml_namespace.size());
  for (const char* word :
       {"http://", "https://", "//cdn", "@import", "<script src", "<link rel=\"stylesheet"})
    EXPECT_EQ(html.find(word), std::string::npos) << word;
  for (std::size_t at = 0; (at = html.find("href=\"", at)) != std::string::npos; ++at)
    EXPECT_EQ(html.compare(at, 11, "href=\"data:"), 0);
}

TEST(Report, HoldsTheCloudToATenThousandthOfItsSize) {
  TemporaryFolder folder;
  WriteToyScan(folder / "scan", 3);
  const std::string html = Report(folder / "scan");
  const nlohmann::json cloud = DataOf(html).at("cloud");
  const std::string bytes = Decode(Inside(html, "cloud"));
  const std::size_t count = cloud.at("shown");
  ASSERT_EQ(count, cloud.at("total"));
  ASSERT_EQ(bytes.size(), count * (6 + 3 + 3 + 1 + 1 + 1));  // places, colours, normals, three scalars
  for (std::size_t i = 0; i < count; ++i) {
    std::uint16_t q[3];
    std::memcpy(q, bytes.data() + 6 * i, 6);
    double p[3], n[3];
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = cloud.at("low")[k].get<double>() + q[k] / 65535.0 * cloud.at("size")[k].get<double>();
      n[k] = double(std::int8_t(bytes[count * 9 + 3 * i + k])) / 127;
    }
    const bool table = std::abs(p[1] + 1) < 1e-3 && n[1] > 0.99;
    if (table) continue;
    ASSERT_NEAR(std::hypot(p[0], p[1], p[2]), 1, 1e-3);  // the ball: its normal is its place
    for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(n[k], p[k], 0.006);
  }
}

TEST(Report, ShowsACameraWhereItStandsWithUpUpwards) {
  TemporaryFolder folder;
  WriteToyScan(folder / "scan", 4);
  const nlohmann::json data = DataOf(Report(folder / "scan"));
  for (const nlohmann::json& view : data.at("views")) {
    const std::vector<double> center = view.at("camera").at("center");
    EXPECT_NEAR(center[1], 2.6, 1e-9);
    EXPECT_NEAR(std::hypot(center[0], center[2]), 5.2, 1e-9);
    double middle[3] = {};  // the mean of the corners is the viewing direction, towards the origin
    for (const auto& corner : view.at("camera").at("corners"))
      for (std::size_t k = 0; k < 3; ++k) middle[k] += corner[k].get<double>() / 4;
    const double length = std::hypot(5.2, 2.6);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(middle[k], -center[k] / length, 1e-9);
  }
}

// Light is polarized along the azimuth of the ball's normal: red to the right, cyan on top.
TEST(Report, AopPictureOfABallIsRedAtTheSidesAndCyanOnTop) {
  TemporaryFolder folder;
  WriteToyScan(folder / "scan", 3);
  const nlohmann::json data = DataOf(Report(folder / "scan"));
  WriteFileAtomically(folder / "aop.jpg", Decode(data.at("views")[0].at("pictures").at("aop")));
  const Picture aop = ReadPicture(folder / "aop.jpg");
  ASSERT_EQ(aop.width(), 160);
  const auto pixel = [&](int x, int y) {
    return std::array{aop.planes[0](x, y), aop.planes[1](x, y), aop.planes[2](x, y)};
  };
  const int radius = int(1.1 * 160 * std::tan(std::asin(1 / std::hypot(5.2, 2.6)))) - 2;
  for (int x : {80 + radius, 79 - radius}) {
    EXPECT_GT(pixel(x, 60)[0], 120);
    EXPECT_LT(pixel(x, 60)[1], 70);
    EXPECT_LT(pixel(x, 60)[2], 70);
  }
  const auto top = pixel(80, 60 - radius);
  EXPECT_LT(top[0], 70);
  EXPECT_GT(top[1], 120);
  EXPECT_GT(top[2], 120);
}

TEST(Report, TheSameScanGivesTheSameBytesForAnyNumberOfThreads) {
  TemporaryFolder folder;
  WriteToyScan(folder / "scan", 5);
  for (const char* threads : {"1", "2"})
    ASSERT_EQ(RunPolarscan({"--threads", threads, "report", (folder / "scan").string(), "-o",
                            (folder / (std::string(threads) + ".html")).string()})
                  .exit_code,
              0);
  EXPECT_EQ(ReadFile(folder / "1.html"), ReadFile(folder / "2.html"));
}

TEST(Report, AFolderWithoutAScanIsAnError) {
  TemporaryFolder folder;
  const Outcome outcome = RunPolarscan({"report", folder.path().string()});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("scan.json"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("polarscan reconstruct"), std::string::npos) << outcome.err;
}

TEST(Report, ADamagedMapOrCloudIsNamedAndStopsNothing) {
  TemporaryFolder folder;
  const fs::path scan = folder / "scan", map = scan / "dense/stereo/depth_maps/ball01.png.geometric.bin";
  WriteToyScan(scan, 3);
  fs::resize_file(map, fs::file_size(map) / 2);
  fs::resize_file(scan / "cloud.ply", fs::file_size(scan / "cloud.ply") / 2);
  const nlohmann::json data = DataOf(Report(scan));
  EXPECT_NE(data.at("notes").dump().find("ball01.png.geometric.bin"), std::string::npos);
  EXPECT_NE(data.at("notes").dump().find("cloud.ply"), std::string::npos);
  EXPECT_NE(data.at("notes").dump().find("Only 2 of 3 views have depth maps"), std::string::npos);
  EXPECT_TRUE(data.at("views")[0].at("pictures").contains("depth"));
}

TEST(Report, DepthIsCountedInsideTheMasks) {
  TemporaryFolder folder;
  const fs::path scan = folder / "scan";
  WriteToyScan(scan, 3);
  const Image<float> depth = ReadDepthMap(scan / "dense/stereo/depth_maps/ball00.png.geometric.bin");
  Image<std::uint8_t> mask(depth.width(), depth.height());
  for (std::size_t i = 0; i < mask.size(); ++i) mask.pixels()[i] = depth.pixels()[i] > 0 ? 255 : 0;
  WritePng(scan / "dense/masks/ball00.png", mask);
  const nlohmann::json views = DataOf(Report(scan)).at("views");
  EXPECT_EQ(views[0].at("depth").at("share"), 1);
  EXPECT_EQ(views[0].at("depth").at("masked"), true);
  EXPECT_LT(views[1].at("depth").at("share"), 0.99);
  EXPECT_EQ(views[1].at("depth").at("masked"), false);
}

TEST(Report, HoldsAnEvaluationOfThisCloudAndNoOther) {
  TemporaryFolder folder;
  const fs::path scan = folder / "scan";
  WriteToyScan(scan, 3);
  WriteMesh(folder / "ball.ply", SphereMesh(200));
  const Outcome outcome = RunPolarscan({"evaluate", scan.string(), "--truth", (folder / "ball.ply").string(),
                                        "--crop", "0.2", "--samples", "20000"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* name : {"depth/ball00.png", "normal/ball02.png", "depth.svg", "normals.svg", "cloud.svg"})
    EXPECT_TRUE(fs::exists(scan / "evaluation" / name)) << name;
  const nlohmann::json data = DataOf(Report(scan));
  EXPECT_LT(data.at("evaluation").at("cloud").at("accuracy").at("median"), 1e-3);
  EXPECT_EQ(data.at("cloud").at("layers").back().at("key"), "error");
  EXPECT_TRUE(data.at("views")[0].at("pictures").contains("normal_error"));
  std::vector<CloudPoint> points(100, {{1, 0, 0}, {1, 0, 0}, {1, 2, 3}, 0, 1, 3});
  WriteCloud(scan / "cloud.ply", points);
  const nlohmann::json later = DataOf(Report(scan));
  EXPECT_TRUE(later.at("evaluation").is_null());
  EXPECT_NE(later.at("notes").dump().find("earlier cloud"), std::string::npos);
}

TEST(Report, MadeAgainAfterAnEvaluationItIsAsTheScanKnowsIt) {
  TemporaryFolder folder;
  const fs::path scan = folder / "scan";
  WriteToyScan(scan, 3);
  nlohmann::json state = ReadJson(scan / "scan.json");
  state["stages"] = {{"report", {{"state", "done"}}}};
  WriteJson(scan / "scan.json", state);
  WriteMesh(folder / "ball.ply", SphereMesh(200));
  ASSERT_EQ(RunPolarscan({"report", scan.string()}).exit_code, kDone);
  const std::string before = ReadFile(scan / "report.html");
  ASSERT_EQ(RunPolarscan(
                {"evaluate", scan.string(), "--truth", (folder / "ball.ply").string(), "--samples", "20000"})
                .exit_code,
            kDone);
  ASSERT_EQ(RunPolarscan({"report", scan.string()}).exit_code, kDone);
  EXPECT_NE(ReadFile(scan / "report.html"), before);
  const Outcome sound = RunPolarscan({"check", scan.string()});
  EXPECT_EQ(sound.exit_code, kDone) << sound.err;
  WriteFileAtomically(scan / "report.html", "changed by hand");
  EXPECT_EQ(RunPolarscan({"check", scan.string()}).exit_code, kDataLost);
}

}  // namespace
}  // namespace polarscan::test
