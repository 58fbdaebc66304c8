// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/model.h"

#include "helpers.h"

namespace polarscan {
namespace {

class SparseModelFiles : public FolderTest {
 protected:
  // Colmap's own program translates between the two forms.
  void Convert(const std::string& from, const std::string& to, const std::string& type) {
    CreateFolder(folder / to);
    Progress progress;
    const auto result = RunProcess({"colmap", "model_converter", "--input_path", folder / from,
                                    "--output_path", folder / to, "--output_type", type},
                                   folder / "log", progress, 60);
    ASSERT_EQ(result.exit_code, 0) << ReadFile(folder / "log");
  }
};

SparseModel Example() {
  SparseModel model = ModelOf(Ring(4));
  model.cameras[7] = {7, "OPENCV", 640, 480, {500.25, 501, 320.5, 239, -0.1, 0.02, 0.001, -0.002}};
  model.images[12].camera_id = 7;
  model.images[12].name = "folder/b.png";
  model.images[11].observations = {{10.5, 20.25, -1}, {30, 40, 5}};
  model.images[12].observations = {{11, 21, 5}};
  model.images[14].observations = {{1.0 / 3, 2.0 / 3, 900}, {7, 8, 5}};
  model.images[13].observations = {{5, 6, 900}};
  model.points[5] = {{0.1, -0.2, 0.3}, {1, 2, 255}, 0.25, {{11, 1}, {12, 0}, {14, 1}}};
  model.points[900] = {{1e-3, 2e5, -3}, {0, 0, 0}, 1.5, {{14, 0}, {13, 0}}};
  return model;
}

void ExpectEqual(const SparseModel& a, const SparseModel& b, double tolerance) {
  ASSERT_EQ(a.cameras.size(), b.cameras.size());
  ASSERT_EQ(a.images.size(), b.images.size());
  ASSERT_EQ(a.points.size(), b.points.size());
  for (const auto& [id, camera] : a.cameras) {
    const ColmapCamera& other = b.cameras.at(id);
    EXPECT_EQ(camera.model, other.model);
    EXPECT_EQ(camera.width, other.width);
    EXPECT_EQ(camera.height, other.height);
    EXPECT_EQ(camera.params, other.params);
  }
  for (const auto& [id, image] : a.images) {
    const ColmapImage& other = b.images.at(id);
    EXPECT_EQ(image.name, other.name);
    EXPECT_EQ(image.camera_id, other.camera_id);
    EXPECT_LT((image.cam_from_world.rotation - other.cam_from_world.rotation).norm(), 1e-12);
    EXPECT_LT((image.cam_from_world.translation - other.cam_from_world.translation).norm(), 1e-12);
    ASSERT_EQ(image.observations.size(), other.observations.size());
    for (std::size_t i = 0; i < image.observations.size(); ++i) {
      EXPECT_NEAR(image.observations[i].x, other.observations[i].x, tolerance);
      EXPECT_NEAR(image.observations[i].y, other.observations[i].y, tolerance);
      EXPECT_EQ(image.observations[i].point_id, other.observations[i].point_id);
    }
  }
  for (const auto& [id, point] : a.points) {
    const ColmapPoint& other = b.points.at(id);
    EXPECT_LT((point.position - other.position).norm(), 1e-9);
    EXPECT_EQ(point.rgb, other.rgb);
    EXPECT_NEAR(point.error_px, other.error_px, 1e-12);
    ASSERT_EQ(point.track.size(), other.track.size());
    for (std::size_t i = 0; i < point.track.size(); ++i) {
      EXPECT_EQ(point.track[i].image_id, other.track[i].image_id);
      EXPECT_EQ(point.track[i].observation, other.track[i].observation);
    }
  }
}

TEST_F(SparseModelFiles, BinaryAndTextComeBack) {
  WriteSparseModelBinary(folder / "bin", Example());
  ExpectEqual(Example(), ReadSparseModel(folder / "bin"), 0);
  WriteSparseModelText(folder / "txt", Example());
  ExpectEqual(Example(), ReadSparseModel(folder / "txt"), 0);
}

TEST_F(SparseModelFiles, ColmapReadsOurBinaryAndWeReadItsText) {
  if (!HasColmap()) GTEST_SKIP() << "COLMAP is not installed";
  WriteSparseModelBinary(folder / "ours", Example());
  Convert("ours", "theirs", "TXT");
  ASSERT_FALSE(std::filesystem::exists(folder / "theirs/cameras.bin"));
  ExpectEqual(Example(), ReadSparseModel(folder / "theirs"),
              1e-4);  // COLMAP keeps few digits of observations
}

TEST_F(SparseModelFiles, ColmapReadsOurTextAndWeReadItsBinary) {
  if (!HasColmap()) GTEST_SKIP() << "COLMAP is not installed";
  WriteSparseModelText(folder / "ours", Example());
  Convert("ours", "theirs", "BIN");
  ASSERT_TRUE(std::filesystem::exists(folder / "theirs/cameras.bin"));
  ExpectEqual(Example(), ReadSparseModel(folder / "theirs"), 1e-4);
}

TEST_F(SparseModelFiles, BinaryWinsOverTextAndPointsMayBeMissing) {
  WriteSparseModelText(folder, Example());
  std::filesystem::remove(folder / "points3D.txt");
  EXPECT_TRUE(ReadSparseModel(folder).points.empty());
  WriteSparseModelBinary(folder, ModelOf(Ring(2)));
  EXPECT_EQ(ReadSparseModel(folder).images.size(), 2u);
}

TEST_F(SparseModelFiles, EveryTruncationOfABinaryFileIsRefused) {
  for (const char* name : {"cameras.bin", "images.bin", "points3D.bin"}) {
    WriteSparseModelBinary(folder, Example());
    const std::string bytes = ReadFile(folder / name);
    for (std::size_t length = 0; length < bytes.size(); length += 3) {
      WriteFileAtomically(folder / name, bytes.substr(0, length));
      EXPECT_THROW(ReadSparseModel(folder), Error) << name << " cut to " << length;
    }
    WriteFileAtomically(folder / name, bytes + "x");
    EXPECT_THROW(ReadSparseModel(folder), Error) << name << " with a byte too many";
  }
}

TEST_F(SparseModelFiles, HugeCountsAreNotBelieved) {
  WriteSparseModelBinary(folder, Example());
  std::string bytes = ReadFile(folder / "images.bin");
  for (int i = 0; i < 8; ++i) bytes[std::size_t(i)] = '\x7f';
  WriteFileAtomically(folder / "images.bin", bytes);
  EXPECT_NE(ErrorOf([&] { ReadSparseModel(folder); }).find("images.bin"), std::string::npos);
}

TEST_F(SparseModelFiles, DamagedTextNamesFileAndLine) {
  WriteSparseModelText(folder, Example());
  const std::string cameras = ReadFile(folder / "cameras.txt");
  WriteFileAtomically(folder / "cameras.txt", cameras + "9 PINHOLE 640 480 500 500 320\n");
  EXPECT_NE(ErrorOf([&] { ReadSparseModel(folder); }).find("line 4"), std::string::npos);
  WriteFileAtomically(folder / "cameras.txt", cameras);
  WriteFileAtomically(folder / "images.txt", "1 0 0 0 0 1 2 3 3 a.png\n\n");  // no rotation
  EXPECT_THROW(ReadSparseModel(folder), Error);
  WriteFileAtomically(folder / "images.txt", "1 1 0 0 0 1 2 3 99 a.png\n\n");  // no such camera
  EXPECT_THROW(ReadSparseModel(folder), Error);
  WriteFileAtomically(folder / "images.txt", "1 1 0 0 0 1 2 3 3 a.png\n10 20\n");  // half an observation
  EXPECT_THROW(ReadSparseModel(folder), Error);
}

TEST_F(SparseModelFiles, NeedAFolderWithAModel) {
  EXPECT_THROW(ReadSparseModel(folder), Error);
  EXPECT_THROW(ReadSparseModel(folder / "missing"), Error);
}

}  // namespace
}  // namespace polarscan
