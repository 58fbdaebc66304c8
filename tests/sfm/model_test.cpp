// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/model/model.h"

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

// A model as people have it who wrote it in an editor, each time in another way.
class HandWritten : public FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    Write("cameras", cameras);
    Write("images", images);
  }
  void Write(const std::string& name, const std::string& text) {
    WriteFileAtomically(folder / (name + ".txt"), text);
  }
  static std::string Replaced(std::string text, const std::string& from, const std::string& to) {
    for (std::size_t at = text.find(from); at != text.npos; at = text.find(from, at + to.size()))
      text.replace(at, from.size(), to);
    return text;
  }
  void ExpectModel(const std::string& how) {
    const SparseModel model = ReadSparseModel(folder);
    ASSERT_EQ(model.images.size(), 3u) << how;
    EXPECT_EQ(model.cameras.at(1).params, (std::vector<double>{500, 501, 160, 128})) << how;
    EXPECT_EQ(model.images.at(2).name, "b 2.png") << how;
    EXPECT_EQ(model.images.at(3).name, "c.png") << how;
    EXPECT_EQ(model.images.at(3).cam_from_world.translation, Eigen::Vector3d(0.5, 0, 3)) << how;
    EXPECT_NEAR(model.images.at(2).cam_from_world.rotation(0, 1), -1, 1e-12) << how;
  }

  const std::string cameras = "1 PINHOLE 320 256 500 501 160 128\n";
  const std::string images =
      "1 1 0 0 0 0 0 3 1 a.png\n\n2 0.70710678118654757 0 0 0.70710678118654757 1e-1 0 3 1 b 2.png\n\n"
      "3 1 0 0 0 0.5 0 3 1 c.png\n\n";
};

TEST_F(HandWritten, TextIsReadWhateverEditorItComesFrom) {
  ExpectModel("as COLMAP writes it");
  const std::string bom = "\xef\xbb\xbf";
  Write("cameras", bom + Replaced(cameras, "\n", "\r\n"));
  Write("images", bom + Replaced(images, "\n", "\r\n"));
  ExpectModel("byte order mark, carriage returns");
  Write("cameras", "  " + Replaced(cameras, " ", "\t ") + "  \n\n");
  Write("images", Replaced(images, "1 a.png\n", "1 a.png  \t\n") + "\n  \n");
  ExpectModel("tabs, blanks and empty lines");
  Write("cameras",
        bom + "# mine\n\t# focal lengths guessed\n" + Replaced(cameras, "128\n", "128 # measured\n"));
  Write("images", "#\n" + Replaced(Replaced(images, "1 a.png\n", "1 a.png # front\n# none yet\n"), "2.png",
                                   "2.png\t#"));
  ExpectModel("comments anywhere");
  Write("cameras", Replaced(cameras, "PINHOLE 320 256", "Pinhole 320.0 2.56e2"));
  Write("images", Replaced(Replaced(images, "\n3 1", "\n3.0 +1"), "3 1 c", "3 1.0 c"));
  ExpectModel("numbers as spreadsheets write them");
}

TEST_F(HandWritten, LinesOfObservationsMayBeLeftOut) {
  Write("images", Replaced(images, "\n\n", "\n"));
  ExpectModel("none");
  Write("images", Replaced(Replaced(images, "\n\n", "\n"), "a.png\n",
                           "a.png\n10 20 -1 30.5 40 18446744073709551615\n"));
  ExpectModel("one of three");
  EXPECT_EQ(ReadSparseModel(folder).images.at(1).observations.at(1).point_id, -1);
  Write("images", "1 1 0 0 0 0 0 3 1 17\n2 1 0 0 0 0 0 4 1 18");
  EXPECT_EQ(ReadSparseModel(folder).images.at(2).name, "18") << "a name that is a number, no line end";
}

TEST_F(HandWritten, WhatCannotBeReadIsQuotedWithItsForm) {
  const auto expect = [&](const std::string& file, const std::string& text,
                          const std::vector<std::string>& words) {
    Write(file, text);
    const std::string message = ErrorOf([&] { ReadSparseModel(folder); });
    for (const std::string& word : words) EXPECT_NE(message.find(word), std::string::npos) << message;
    EXPECT_EQ(message.find("damaged"), std::string::npos) << message;
    Write("cameras", cameras);
    Write("images", images);
  };
  expect("images", "# x\n1, 1, 0, 0, 0, 0, 0, 3, 1, a.png\n",
         {"line 2", "\"1, 1, 0", "QW QX QY QZ", "images.txt"});
  expect("images", "1 1 0 0 0 0 0 3 1\n", {"line 1", "name is missing"});
  expect("images", images + "3 1 0 0 0 0 0 3 1 d.png\n", {"line 7", "an image 3 already, c.png"});
  expect("images", "1 1 0 0 0 0 0 3 9 a.png\n", {"no camera 9", "a.png"});
  expect("images", "\xff\xfe 1", {"UTF-16"});
  expect("cameras", "1 PINHOLE 320 256 500 160 128\n", {"line 1", "PINHOLE takes 4 parameters, these are 3"});
}

TEST_F(HandWritten, AQuaternionOfAnotherLengthIsNotedAndTakenForItsDirection) {
  std::vector<std::string> notes;
  ReadSparseModel(folder, &notes);
  EXPECT_TRUE(notes.empty());
  Write("images", Replaced(images, "0.70710678118654757", "2"));
  const SparseModel model = ReadSparseModel(folder, &notes);
  EXPECT_NEAR(model.images.at(2).cam_from_world.rotation(0, 1), -1, 1e-12);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("b 2.png"), std::string::npos) << notes[0];
}

TEST_F(HandWritten, PointsMayNameImagesThatWereTakenOut) {
  Write("points3D", "7 0 0 1 255 255 255 0.5 1 0 8 3 # seen by 1 and 8\n");
  EXPECT_TRUE(ReadSparseModel(folder).points.at(7).track.empty());
}

TEST_F(HandWritten, TheOnlyModelOneFolderDownIsTaken) {
  const std::filesystem::path sparse = folder / "sparse";
  WriteSparseModelBinary(sparse / "3", Example());
  EXPECT_EQ(ReadSparseModel(sparse).images.size(), 4u);
  EXPECT_EQ(FindSparseModel(sparse), sparse / "3");
  WriteSparseModelText(sparse / "10", Example());
  const std::string message = ErrorOf([&] { ReadSparseModel(sparse); });
  EXPECT_NE(message.find("2 COLMAP models here (10, 3)"), std::string::npos) << message;
}

TEST_F(SparseModelFiles, NeedAFolderWithAModel) {
  EXPECT_THROW(ReadSparseModel(folder), Error);
  EXPECT_THROW(ReadSparseModel(folder / "missing"), Error);
}

}  // namespace
}  // namespace polarscan
