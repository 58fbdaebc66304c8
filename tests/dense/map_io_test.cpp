// SPDX-License-Identifier: Apache-2.0
#include "stereo/map_io.h"

#include <cstring>

#include "tests/sfm/helpers.h"

namespace polarscan {
namespace {

class MapIo : public FolderTest {};

TEST_F(MapIo, DepthMapHasColmapsHeaderAndRowsOfFloats) {
  Image<float> depth(3, 2);
  for (int i = 0; i < 6; ++i) depth.pixels()[std::size_t(i)] = 0.5f * float(i);
  WriteDepthMap(folder / "d.bin", depth);
  const std::string bytes = ReadFile(folder / "d.bin");
  ASSERT_EQ(bytes.size(), 6 + 24u);
  EXPECT_EQ(bytes.substr(0, 6), "3&2&1&");
  float value;  // row 1, column 2 is the last one
  std::memcpy(&value, bytes.data() + 6 + 5 * 4, 4);
  EXPECT_EQ(value, 2.5f);
  const Image<float> again = ReadDepthMap(folder / "d.bin");
  EXPECT_TRUE(std::ranges::equal(again.pixels(), depth.pixels()));
}

TEST_F(MapIo, NormalMapIsStoredPlaneByPlane) {
  Image<Eigen::Vector3f> normals(2, 1, Eigen::Vector3f(0, 0, 0));
  normals(0, 0) = {1, 2, 3};
  normals(1, 0) = {4, 5, 6};
  WriteNormalMap(folder / "n.bin", normals);
  const std::string bytes = ReadFile(folder / "n.bin");
  ASSERT_EQ(bytes.substr(0, 6), "2&1&3&");
  float planes[6];
  ASSERT_EQ(bytes.size(), 6 + sizeof planes);
  std::memcpy(planes, bytes.data() + 6, sizeof planes);
  const float expected[] = {1, 4, 2, 5, 3, 6};
  EXPECT_TRUE(std::ranges::equal(planes, expected));
  EXPECT_EQ(ReadNormalMap(folder / "n.bin")(1, 0), Eigen::Vector3f(4, 5, 6));
}

TEST_F(MapIo, DamagedMapsAreRefusedByName) {
  const std::string payload(24, '\0');
  for (const std::string& bytes :
       {std::string(), std::string("3&2&1"), "3&2&1&" + payload.substr(1), "3&2&1&" + payload + "x",
        "3&2&2&" + payload, "0&2&1&" + payload, "-3&2&1&" + payload, "3&2x&1&" + payload,
        "65536&65536&1&" + payload, "999999999999999999999&1&1&" + payload, std::string("\x89PNG")}) {
    WriteFileAtomically(folder / "bad.bin", bytes);
    EXPECT_NE(ErrorOf([&] { ReadDepthMap(folder / "bad.bin"); }).find("bad.bin"), std::string::npos) << bytes;
  }
  EXPECT_THROW(ReadDepthMap(folder / "missing.bin"), Error);
  WriteFileAtomically(folder / "depth.bin", "3&2&1&" + payload);
  EXPECT_NO_THROW(ReadDepthMap(folder / "depth.bin"));
  EXPECT_THROW(ReadNormalMap(folder / "depth.bin"), Error);
}

class WorkspaceFile : public FolderTest {};

TEST_F(WorkspaceFile, ComesBackExactly) {
  Workspace workspace{folder, Ring(5), true};
  for (int i = 0; i < 5; ++i) {
    workspace.views[std::size_t(i)].depth_min = 2.0 + i / 3.0;
    workspace.views[std::size_t(i)].depth_max = 7;
    workspace.views[std::size_t(i)].sources = {(i + 2) % 5, (i + 1) % 5};
  }
  WriteWorkspace(workspace);
  const Workspace again = ReadWorkspace(folder);
  ASSERT_EQ(again.views.size(), 5u);
  EXPECT_TRUE(again.polarized);
  for (int i = 0; i < 5; ++i) {
    const DenseView &a = again.views[std::size_t(i)], &b = workspace.views[std::size_t(i)];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.cam_from_world.rotation, b.cam_from_world.rotation);
    EXPECT_EQ(a.cam_from_world.translation, b.cam_from_world.translation);
    EXPECT_EQ(a.camera.fx, b.camera.fx);
    EXPECT_EQ(a.depth_min, b.depth_min);
    EXPECT_EQ(a.sources, b.sources);
  }
}

TEST_F(WorkspaceFile, ImpossibleValuesAreRefused) {
  EXPECT_THROW(ReadWorkspace(folder), Error);
  Workspace workspace{folder, Ring(3), true};
  for (DenseView& view : workspace.views) view.depth_min = 1, view.depth_max = 2;
  const auto is_refused = [&](auto&& spoil) {
    Workspace bad = workspace;
    spoil(bad.views[1]);
    WriteWorkspace(bad);
    EXPECT_THROW(ReadWorkspace(folder), Error);
  };
  is_refused([](DenseView& view) { view.sources = {3}; });
  is_refused([](DenseView& view) { view.sources = {1}; });
  is_refused([](DenseView& view) { view.depth_max = 0.5; });
  is_refused([](DenseView& view) { view.name = "../x"; });
  is_refused([](DenseView& view) { view.cam_from_world.rotation *= 2; });
  for (const char* width : {"1e80", "4294967396", "99.5"}) {
    WriteWorkspace(workspace);
    nlohmann::json file = ReadJson(folder / "views.json");
    file["views"][0]["camera"]["width"] = nlohmann::json::parse(width);
    WriteJson(folder / "views.json", file);
    EXPECT_THROW(ReadWorkspace(folder), Error) << width;
  }
  WriteFileAtomically(folder / "views.json", "{\"format\": 3");
  EXPECT_THROW(ReadWorkspace(folder), Error);
  WriteFileAtomically(folder / "views.json", "[1, 2]");
  EXPECT_THROW(ReadWorkspace(folder), Error);
}

TEST_F(WorkspaceFile, MasksMustFitTheirCamera) {
  Workspace workspace{folder, Ring(2), true};
  EXPECT_TRUE(ReadViewMask(workspace, 0).empty());
  WritePng(workspace.MaskPath(0), Image<std::uint8_t>(120, 100, 255));
  WritePng(workspace.MaskPath(1), Image<std::uint8_t>(100, 120, 255));
  EXPECT_EQ(ReadViewMask(workspace, 0).width(), 120);
  EXPECT_THROW(ReadViewMask(workspace, 1), Error);
}

}  // namespace
}  // namespace polarscan
