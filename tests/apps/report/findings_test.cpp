// SPDX-License-Identifier: Apache-2.0
// What the report says about coverage, and how it holds a mesh and errors: from its data.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>

#include "core/files/files.h"
#include "core/formats/ply.h"
#include "core/mesh.h"
#include "program.h"
#include "report/report_data.h"
#include "tests/fusion/sphere_scene.h"
#include "toy_scan.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

std::vector<json> FindingsOf(const json& data, const std::string& kind) {
  std::vector<json> found;
  for (const json& finding : data.at("findings").at("list"))
    if (finding.at("kind") == kind) found.push_back(finding);
  return found;
}

double AngleTo(const json& from, const Eigen::Vector3d& direction) {
  return AngleDegrees({from[0].get<double>(), from[1].get<double>(), from[2].get<double>()}, direction);
}

TEST(Findings, CamerasAllAroundLeaveOnlyTheTopEmpty) {
  TemporaryFolder folder;
  WriteToyScan(folder / "scan", 12);  // a ring, 30 degrees apart, 26.6 degrees up
  const json data = ReportData(folder / "scan");
  const std::vector<json> gaps = FindingsOf(data, "coverage");
  ASSERT_EQ(gaps.size(), 1u);
  EXPECT_LT(AngleTo(gaps[0].at("from"), Eigen::Vector3d::UnitY()), 10);
  EXPECT_NE(gaps[0].at("text").get<std::string>().find("from straight above"), std::string::npos);
  EXPECT_EQ(FindingsOf(data, "underside").size(), 1u);
}

TEST(Findings, ASideWithoutCamerasIsNamedByTheCameraNextToIt) {
  TemporaryFolder folder;
  const fs::path scan = folder / "scan";
  WriteToyScan(scan, 12);
  json workspace = ReadJson(scan / "dense/views.json");
  auto& views = workspace.at("views");  // cameras 4 to 8 look from 120 to 240 degrees
  views.erase(views.begin() + 4, views.begin() + 9);
  for (std::size_t i = 0; i < 7; ++i) views[i]["sources"] = {(i + 1) % 7, (i + 6) % 7};
  WriteJson(scan / "dense/views.json", workspace);
  const json data = ReportData(scan);
  bool behind = false;
  const auto& cameras = data.at("findings").at("coverage").at("cameras");
  ASSERT_EQ(cameras.size(), 7u);
  double x = 0, z = 0;  // the seven stand around one side: their mean azimuth is the front
  for (const json& camera : cameras) {
    x += std::sin(camera.at("azimuth").get<double>() * std::numbers::pi / 180);
    z += std::cos(camera.at("azimuth").get<double>() * std::numbers::pi / 180);
  }
  for (const json& gap : FindingsOf(data, "coverage")) {
    const auto from = gap.at("from").get<std::vector<double>>();
    behind = behind || from[0] * x + from[2] * z < -0.5 * std::hypot(x, z);
    const auto text = gap.at("text").get<std::string>();
    const bool beside =
        text.find("of ball03") != std::string::npos || text.find("of ball09") != std::string::npos;
    EXPECT_TRUE(beside || text.find("straight above") != std::string::npos) << text;
  }
  EXPECT_TRUE(behind);
}

TEST(Findings, TheGridTellsTheAngleToTheNearestCamera) {
  TemporaryFolder folder;
  WriteToyScan(folder / "scan", 12);
  const json coverage = ReportData(folder / "scan").at("findings").at("coverage");
  const double step = coverage.at("step");
  for (std::size_t i = 0; i < coverage.at("cells").size(); ++i)
    for (std::size_t j = 0; j < coverage.at("cells")[i].size(); ++j) {
      const double e = (-90 + step * (double(i) + 0.5)) * std::numbers::pi / 180,
                   a = step * (double(j) + 0.5) * std::numbers::pi / 180;
      double nearest = 180;
      for (const json& camera : coverage.at("cameras")) {
        const double ce = camera.at("elevation").get<double>() * std::numbers::pi / 180,
                     ca = camera.at("azimuth").get<double>() * std::numbers::pi / 180;
        const double cosine = std::sin(e) * std::sin(ce) + std::cos(e) * std::cos(ce) * std::cos(a - ca);
        nearest = std::min(nearest, std::acos(cosine) * 180 / std::numbers::pi);
      }
      ASSERT_NEAR(coverage.at("cells")[i][j].get<double>(), nearest, 0.51);
    }
}

TEST(Findings, WeakPolarizationIsThatBelowThreeTimesItsNoise) {
  TemporaryFolder folder;
  WriteToyScan(folder / "scan", 6);  // noise of DoP about 0.002, of the table and the ball's rim up to 0.35
  const json data = ReportData(folder / "scan");
  const auto found = FindingsOf(data, "polarization");
  ASSERT_EQ(found.size(), 1u);
  PlyFile cloud = ReadPly(folder / "scan/cloud.ply");
  std::vector<double> noise;
  for (int i = 0; i < 6; ++i) {
    const StokesImage view = ReadStokes(folder / ("scan/dense/polar/ball0" + std::to_string(i) + ".tif"));
    for (std::size_t k = 0; k < view.s0.size(); ++k)
      if (view.s0.pixels()[k] > 0.05) noise.push_back(std::sqrt(2) * 1e-3 / view.s0.pixels()[k]);
  }
  std::ranges::sort(noise);
  const double weak = noise[noise.size() / 2] / (2 * 10 * std::numbers::pi / 180);
  const auto& dop = cloud["vertex"].columns["dop"];
  const double share =
      double(std::ranges::count_if(dop, [&](double d) { return d < weak; })) / double(dop.size());
  EXPECT_EQ(found[0].value("good", false), share < 0.2) << share;
}

TEST(Findings, NothingIsSaidOfPolarizationThatIsNotThereOrNotUsed) {
  TemporaryFolder folder;
  const fs::path state = folder / "scan/scan.json";
  WriteToyScan(folder / "scan", 3);
  const json before = ReadJson(state);
  for (const char* place : {"/views/polarized", "/options/stereo/polarization"}) {
    json changed = before;
    changed[json::json_pointer(place)] = false;
    WriteJson(state, changed);
    EXPECT_TRUE(FindingsOf(ReportData(folder / "scan"), "polarization").empty()) << place;
  }
}

TEST(Findings, PicturesWithoutAPlaceAreCounted) {
  TemporaryFolder folder;
  WriteToyScan(folder / "scan", 6);
  const auto found = FindingsOf(ReportData(folder / "scan"), "registration");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].at("title"), "1 of 7 pictures have no place");
}

// Triangles of the page's mesh, display frame.
struct PageMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::uint32_t> indices;
};

PageMesh MeshOf(const std::string& html) {
  const json facts = DataOf(html).at("mesh");
  const std::string bytes = Decode(Inside(html, "mesh"));
  PageMesh mesh;
  mesh.indices.resize(3 * facts.at("shown").get<std::size_t>());
  std::memcpy(mesh.indices.data(), bytes.data(), 4 * mesh.indices.size());
  const char* places = bytes.data() + 4 * mesh.indices.size();
  for (std::size_t i = 0; i < facts.at("vertices"); ++i) {
    std::uint16_t q[3];
    std::memcpy(q, places + 6 * i, 6);
    Eigen::Vector3d p;
    for (int k = 0; k < 3; ++k)
      p[k] = facts.at("low")[std::size_t(k)].get<double>() +
             q[k] / 65535.0 * facts.at("size")[std::size_t(k)].get<double>();
    mesh.vertices.push_back(p);
  }
  return mesh;
}

TEST(ReportMesh, StaysOnTheSurfaceWhenItIsMadeSmaller) {
  TemporaryFolder folder;
  WriteToyScan(folder / "scan", 3);
  WriteMesh(folder / "scan/mesh.ply", SphereMesh(500));  // 998,000 triangles
  const std::string html = Report(folder / "scan");
  const json facts = DataOf(html).at("mesh");
  EXPECT_EQ(facts.at("total"), 998000);
  EXPECT_LE(facts.at("shown").get<int>(), 260000);
  EXPECT_GE(facts.at("shown").get<int>(), 150000);
  EXPECT_LT(html.size(), 30'000'000u);
  const PageMesh mesh = MeshOf(html);
  for (const Eigen::Vector3d& v : mesh.vertices) ASSERT_NEAR(v.norm(), 1, 1e-3);
  double area = 0;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    ASSERT_LT(mesh.indices[i], mesh.vertices.size());
    const auto& a = mesh.vertices[mesh.indices[i]];
    area += (mesh.vertices[mesh.indices[i + 1]] - a).cross(mesh.vertices[mesh.indices[i + 2]] - a).norm() / 2;
  }
  EXPECT_NEAR(area / (4 * std::numbers::pi), 1, 0.02);
}

TEST(ReportMesh, HasTheLayersOfTheCloudNextToIt) {
  TemporaryFolder folder;
  WriteToyScan(folder / "scan", 3);
  WriteMesh(folder / "scan/mesh.ply", SphereMesh(20));
  const json data = ReportData(folder / "scan");
  std::vector<std::string> keys;
  for (const json& layer : data.at("mesh").at("layers")) keys.push_back(layer.at("key"));
  EXPECT_EQ(keys, (std::vector<std::string>{"normal", "dop", "confidence", "views"}));
}

TEST(ReportMesh, ThatIsDamagedIsNamedAndStopsNothing) {
  TemporaryFolder folder;
  WriteToyScan(folder / "scan", 3);
  WriteMesh(folder / "scan/mesh.ply", SphereMesh(20));
  fs::resize_file(folder / "scan/mesh.ply", 2000);
  const json data = ReportData(folder / "scan");
  EXPECT_NE(data.at("notes").dump().find("mesh.ply"), std::string::npos);
  EXPECT_TRUE(data.at("mesh").is_null());
  EXPECT_FALSE(data.at("cloud").is_null());
}

// What a stage of a toy scan counted.
void SetCounts(const fs::path& scan, const char* stage, const json& counts) {
  json state = ReadJson(scan / "scan.json");
  state["stages"][stage]["counts"] = counts;
  WriteJson(scan / "scan.json", state);
}

TEST(Findings, AResultInPiecesIsSaidAndPolarizationIsNotPraisedForIt) {
  TemporaryFolder folder;
  WriteToyScan(folder / "scan", 6);
  EXPECT_TRUE(FindingsOf(ReportData(folder / "scan"), "agreement").empty());
  SetCounts(
      folder / "scan", "fusion",
      {{"pixels", {{"with_depth", 1000}, {"masked", 0}, {"too_few_views", 720}}}, {"neighbour_deg", 60.2}});
  SetCounts(folder / "scan", "mesh", {{"pieces_dropped", 215}});
  const json data = ReportData(folder / "scan");
  const auto pieces = FindingsOf(data, "agreement");
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_FALSE(pieces[0].value("good", false));
  for (const char* said : {"72 %", "60 degrees apart", "Take more in between", "215 loose pieces"})
    EXPECT_NE(pieces[0].dump().find(said), std::string::npos) << said << ": " << pieces[0];
  for (const json& finding : FindingsOf(data, "polarization")) EXPECT_FALSE(finding.value("good", false));
}

TEST(Findings, AnglesThatDoNotFitTheShapeAreSaidAndNotPraised) {
  TemporaryFolder folder;
  WriteToyScan(folder / "scan", 6);
  SetCounts(
      folder / "scan", "stereo",
      {{"angles", {{"wrong", true}, {"advice", "they do not fit. Run again with --aop-sense clockwise"}}}});
  const json data = ReportData(folder / "scan");
  const auto angles = FindingsOf(data, "angles");
  ASSERT_EQ(angles.size(), 1u);
  EXPECT_NE(
      angles[0].at("text").get<std::string>().find("They do not fit. Run again with --aop-sense clockwise"),
      std::string::npos);
  for (const json& finding : FindingsOf(data, "polarization")) EXPECT_FALSE(finding.value("good", false));
}

TEST(Findings, MasksThatWereMendedAreSaid) {
  TemporaryFolder folder;
  WriteToyScan(folder / "scan", 6);
  EXPECT_TRUE(FindingsOf(ReportData(folder / "scan"), "masks").empty());
  SetCounts(folder / "scan", "dense", {{"masks", {{"mended", "all were about 5 px too wide"}}}});
  const auto masks = FindingsOf(ReportData(folder / "scan"), "masks");
  ASSERT_EQ(masks.size(), 1u);
  EXPECT_EQ(masks[0].at("text"), "All were about 5 px too wide.");
}

TEST(Findings, WhatIsKnownFromOutlinesAloneIsSaidWhereItIsMuch) {
  TemporaryFolder folder;
  WriteToyScan(folder / "scan", 3);
  SetCounts(folder / "scan", "mesh", {{"hull_area", 0.01}});
  EXPECT_TRUE(FindingsOf(ReportData(folder / "scan"), "hull").empty());
  SetCounts(folder / "scan", "mesh", {{"hull_area", 0.31}});
  const auto found = FindingsOf(ReportData(folder / "scan"), "hull");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NE(found[0].at("text").get<std::string>().find("On 31 %"), std::string::npos) << found[0].dump();
}

TEST(Findings, PolarizationThatWasCorrectedIsSaid) {
  TemporaryFolder folder;
  WriteToyScan(folder / "scan", 6);
  SetCounts(folder / "scan", "stereo",
            {{"angles", {{"wrong", false}, {"corrected", "turned by 5 degrees"}}}});
  const auto angles = FindingsOf(ReportData(folder / "scan"), "angles");
  ASSERT_EQ(angles.size(), 1u);
  EXPECT_EQ(angles[0].at("text"), "Turned by 5 degrees.");
}

}  // namespace
}  // namespace polarscan::test
