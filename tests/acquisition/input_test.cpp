// SPDX-License-Identifier: Apache-2.0
#include "acquisition/input/input.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "core/error.h"
#include "core/files.h"
#include "core/picture_tags.h"
#include "core/random.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

// A folder of its own for each test, removed afterwards.
class InputTest : public testing::Test {
 protected:
  InputTest() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() /
              (std::string("polarscan-input-") + test->name() + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~InputTest() override { fs::remove_all(folder_); }

  void Grey8(const std::string& name, int width = 8, int height = 6, int value = 100) const {
    WritePng(folder_ / name, Image<std::uint8_t>(width, height, std::uint8_t(value)));
  }
  void Grey16(const std::string& name, int value, int width = 8, int height = 6) const {
    WritePng(folder_ / name, Image<std::uint16_t>(width, height, std::uint16_t(value)));
  }
  void Colour(const std::string& name) const { WritePng(folder_ / name, Image<Rgb8>(8, 6, {200, 100, 50})); }
  void Floats(const std::string& name, std::size_t pages) const {
    const Image<float> page(8, 6, 0.5f);
    WriteFloatTiff(folder_ / name, std::vector<const Image<float>*>(pages, &page));
  }
  void Angles(const std::vector<std::string>& views) const {
    for (const char* angle : {"I-00", "I-45", "I-90", "I-135"})
      for (const std::string& view : views) Grey8(std::string(angle) + "/" + view + ".png");
  }
  void Set(const std::string& json) const { WriteFileAtomically(folder_ / "set.json", json); }

  Input Open(const InputOptions& options = {}) const { return OpenInput(folder_, options); }
  // The message of the error that opening the folder and reading all its views throws; empty if none.
  std::string Complaint(const InputOptions& options = {}) const {
    try {
      const Input input = Open(options);
      for (int view = 0; view < int(input.views.size()); ++view) ReadView(input, view);
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  }

  fs::path folder_;
};

bool Says(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }
#define EXPECT_SAYS(text, part) EXPECT_PRED2(Says, text, part)

std::vector<std::string> Names(const Input& input) {
  std::vector<std::string> names;
  for (const InputView& view : input.views) names.push_back(view.name);
  return names;
}

using List = std::vector<std::string>;

TEST_F(InputTest, MosaicFolderWithItsLayoutInSetJson) {
  Grey16("mosaic/b.png", 4000);
  Grey16("mosaic/a.png", 300);
  Grey8("preview.png");
  const nlohmann::json sensor = {{"layout", "90 45 / 135 0 (top-left pixel 90)"},
                                 {"bits", 12},
                                 {"black_dn", 60},
                                 {"max_dn", 4095},
                                 {"dn_per_e", 0.375},
                                 {"read_noise_e", 2.5},
                                 {"full_well_e", 10500}};
  Set(nlohmann::json({{"format", "mosaic"}, {"sensor", sensor}}).dump());
  const Input input = Open();
  EXPECT_EQ(input.kind, InputKind::kMosaic);
  EXPECT_EQ(Names(input), (List{"a", "b"}));
  EXPECT_EQ(input.sensor.layout, ParseLayout("90 45 / 135 0"));
  EXPECT_EQ(input.sensor.bits, 12);
  EXPECT_EQ(input.sensor.black_dn, 60);
  EXPECT_EQ(input.sensor.white_dn, 3997);  // the full well ends before the counts do: 60 + 10500 * 0.375
  EXPECT_EQ(input.sensor.dn_per_e, 0.375);
  EXPECT_EQ(input.sensor.read_noise_e, 2.5);
  EXPECT_EQ(ReadView(input, 1).pictures[0].planes[0](3, 3), 4000);
}

// A sensor that saturates at 3800 of 4095, which nobody says. Two thirds of one picture are below that.
TEST_F(InputTest, WhereSamplesPileUpIsTheWhiteLevelUnlessItIsSaid) {
  Image<std::uint16_t> dim(96, 64), bright(96, 64);
  for (std::size_t i = 0; i < dim.size(); ++i) {
    const double light = Random(5, i).Uniform();
    dim.pixels()[i] = std::uint16_t(60 + 2000 * light);
    bright.pixels()[i] = std::uint16_t(std::min(3800.0, 60 + 5600 * light));
  }
  WritePng(folder_ / "mosaic/a.png", dim);
  const InputOptions options = {.layout = "90 45 / 135 0", .bits = 12};
  EXPECT_EQ(Open(options).sensor.white_dn, 4095);
  WritePng(folder_ / "mosaic/b.png", bright);
  const Input input = Open(options);
  EXPECT_NEAR(input.sensor.white_dn, 3800, 3);
  EXPECT_SAYS(input.notes.at(0), "pile up at");
  const Image<std::uint8_t> clipped = Clipped(ReadView(input, 1).pictures[0].planes[0], input.sensor);
  EXPECT_NEAR(double(std::ranges::count(clipped.pixels(), 1)) / double(clipped.size()), 1 / 3.0, 0.03);
  EXPECT_EQ(Open({.layout = "90 45 / 135 0", .bits = 12, .white_level = 4095}).sensor.white_dn, 4095);
  Set(R"({"sensor": {"max_dn": 4095}})");  // which says no more than the bits
  EXPECT_NEAR(Open(options).sensor.white_dn, 3800, 3);
}

TEST_F(InputTest, AWhiteLevelThatNoCountReachesIsWarnedOf) {
  Grey16("mosaic/a.png", 900);
  for (const auto& [white, warned] : {std::pair(4095, false), std::pair(40000, true)}) {
    Set(fmt::format(R"({{"sensor": {{"layout": "90 45 / 135 0", "bits": 12, "white_dn": {}}}}})", white));
    const Input input = Open();
    const bool said = std::ranges::any_of(input.warnings, [](const std::string& text) {
      return text.find("no count of these 12-bit pictures reaches the white level 40000") !=
             std::string::npos;
    });
    EXPECT_EQ(said, warned) << white;
  }
}

TEST_F(InputTest, AnOptionThatCannotCountAndJpegMosaicsAreWarnedOf) {
  const auto warnings = [&] {
    std::string all;
    for (const std::string& text : Open({.layout = "90 45 / 135 0"}).warnings) all += text + "\n";
    return all;
  };
  Angles({"a", "b"});
  EXPECT_SAYS(warnings(), "--layout is for raw mosaics and not used");
  fs::remove_all(folder_);
  Grey8("mosaic/a.png");
  EXPECT_EQ(warnings(), "");
  WriteFileAtomically(folder_ / "mosaic/b.jpg", EncodeJpeg(Image<Rgb8>(8, 6, {100, 100, 100}), 90));
  EXPECT_SAYS(warnings(), "1 of 2 raw mosaics are JPEG");
}

TEST_F(InputTest, OptionsWinOverSetJson) {
  Grey16("mosaic/a.png", 300);
  Set(R"({"sensor": {"layout": "90 45 / 135 0", "bits": 12, "black_dn": 60, "white_dn": 4000}})");
  const Input input = Open({.layout = "0 45 / 135 90", .bits = 10, .black_level = 16, .white_level = 1000});
  EXPECT_EQ(input.sensor.layout, ParseLayout("0 45 / 135 90"));
  EXPECT_EQ(input.sensor.bits, 10);
  EXPECT_EQ(input.sensor.black_dn, 16);
  EXPECT_EQ(input.sensor.white_dn, 1000);
}

TEST_F(InputTest, AnglesInBothSpellings) {
  Angles({"001", "000"});
  const Input input = Open();
  EXPECT_EQ(input.kind, InputKind::kAngles);
  EXPECT_EQ(Names(input), (List{"000", "001"}));
  ASSERT_EQ(input.views[0].files.size(), 4u);
  EXPECT_EQ(input.views[0].files[1], folder_ / "I-45/000.png");
  EXPECT_EQ(input.sensor.white_dn, 255);

  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {"I-00", "0"}, {"I-45", "45"}, {"I-90", "90"}, {"I-135", "135"}})
    fs::rename(folder_ / from, folder_ / to);
  EXPECT_EQ(Open().views[1].files[3], folder_ / "135/001.png");
}

TEST_F(InputTest, StokesPagesNamedFilesAndFolders) {
  Floats("stokes/a.tif", 4);
  EXPECT_EQ(Open().kind, InputKind::kStokes);
  EXPECT_EQ(ReadView(Open(), 0).pictures.size(), 4u);
  fs::remove_all(folder_ / "stokes");

  Floats("b.tif", 3);
  EXPECT_EQ(Open().kind, InputKind::kStokes);
  fs::remove(folder_ / "b.tif");

  for (const char* name : {"v_s0.tif", "v_S1.tif", "v_s2.tif"}) Floats(name, 1);
  EXPECT_EQ(Open().kind, InputKind::kStokes);
  EXPECT_EQ(Names(Open()), List{"v"});
  EXPECT_EQ(Open().views[0].files[1], folder_ / "v_S1.tif");
  for (const char* name : {"v_s0.tif", "v_S1.tif", "v_s2.tif"}) fs::remove(folder_ / name);

  for (const char* name : {"s0/w.tif", "s1/w.tif", "s2/w.tif"}) Floats(name, 1);
  EXPECT_EQ(Open().kind, InputKind::kStokes);
  EXPECT_EQ(Names(Open()), List{"w"});
}

TEST_F(InputTest, RgbAopDop) {
  Colour("rgb/a.png");
  Grey16("aop/a.png", 1000);
  Grey16("dop/a.png", 1000);
  const Input input = Open();
  EXPECT_EQ(input.kind, InputKind::kRgbAopDop);
  EXPECT_FALSE(input.clockwise);
  ASSERT_FALSE(input.notes.empty());  // the sense is assumed, and that is said
  EXPECT_SAYS(input.notes[0], "--aop-sense");
  const Input other = Open({.aop_sense = "clockwise", .aop_scale = "degrees"});
  EXPECT_TRUE(other.clockwise);
  EXPECT_EQ(other.aop_scale, "degrees");
  EXPECT_EQ(Meaning(other)["aop_sense"], "clockwise");
  fs::remove_all(folder_ / "rgb");
  EXPECT_SAYS(Complaint(), "rgb/ is missing");
}

TEST_F(InputTest, ColourPicturesAreOnlyPhotos) {
  Colour("a.png");
  const Input input = Open();
  EXPECT_EQ(input.kind, InputKind::kPhotos);
  EXPECT_FALSE(input.polarized());
  EXPECT_EQ(input.sensor.gamma, 2.2);
  ASSERT_FALSE(input.notes.empty());
  EXPECT_SAYS(input.notes[0], "no polarization");
  EXPECT_SAYS(Complaint({.kind = "mosaic", .layout = "90 45 / 135 0"}), "one channel");
}

TEST_F(InputTest, MasksAndKnownPosesAreFound) {
  Angles({"000", "001"});
  WritePng(folder_ / "masks/001.png", Image<std::uint8_t>(8, 6, 255));
  fs::create_directories(folder_ / "sparse");
  const Input input = Open();
  EXPECT_FALSE(input.views[0].mask);
  EXPECT_EQ(input.views[1].mask, folder_ / "masks/001.png");
  EXPECT_EQ(ReadView(input, 1).mask(2, 2), 255);
  EXPECT_TRUE(ReadView(input, 0).mask.empty());
  EXPECT_EQ(input.known_model, folder_ / "sparse");
  EXPECT_SAYS(input.notes.at(0), "1 of 2 views have no mask");
}

TEST_F(InputTest, EverythingEffectiveIsWrittenForTheRecord) {
  Angles({"000"});
  const nlohmann::json json = ToJson(Open({.black_level = 5, .gamma = 2}));
  EXPECT_EQ(json["kind"], "angles");
  EXPECT_EQ(json["views"], 1);
  EXPECT_EQ(json["sensor"]["black_dn"], 5);
  EXPECT_EQ(json["sensor"]["gamma"], 2);
  EXPECT_EQ(json["sensor"]["white_dn"], 255);
  EXPECT_EQ(json["aop_sense"], "anticlockwise");
  EXPECT_TRUE(json["known_model"].is_null());
}

TEST_F(InputTest, AMissingFolderIsNamed) {
  EXPECT_SAYS(Complaint(), "no pictures");
  fs::remove_all(folder_);
  EXPECT_SAYS(Complaint(), "there is no such folder");
  EXPECT_SAYS(Complaint(), folder_.string());
  WriteFileAtomically(folder_, "a file");
  EXPECT_SAYS(Complaint(), "this is a file");
}

TEST_F(InputTest, AnEmptyFolderSaysWhatIsWanted) {
  EXPECT_SAYS(Complaint(), "there are no pictures here");
  fs::create_directories(folder_ / "mosaic");
  EXPECT_SAYS(Complaint({.layout = "90 45 / 135 0"}), "no mosaic pictures");
}

TEST_F(InputTest, AngleFoldersWithDifferentViewsNameTheMissingOnes) {
  Angles({"000", "001", "002"});
  fs::remove(folder_ / "I-45/001.png");
  fs::remove(folder_ / "I-135/002.png");
  const std::string complaint = Complaint();
  EXPECT_SAYS(complaint, "I-45/ lacks 001");
  EXPECT_SAYS(complaint, "I-135/ lacks 002");
  fs::remove_all(folder_ / "I-90");
  EXPECT_SAYS(Complaint(), "the folder of the angle 90 is missing");
}

TEST_F(InputTest, PicturesOfOneViewThatDifferInSizeAreNamed) {
  Angles({"000", "001"});
  Grey8("I-90/001.png", 9, 6);
  const std::string complaint = Complaint();
  EXPECT_SAYS(complaint, "8x6 and 9x6");
  EXPECT_SAYS(complaint, "I-90/001.png");
  Colour("I-90/001.png");
  EXPECT_SAYS(Complaint(), "differ in colour");
}

TEST_F(InputTest, ATruncatedPngIsNamed) {
  Angles({"000", "001"});
  const std::string bytes = ReadFile(folder_ / "I-45/001.png");
  WriteFileAtomically(folder_ / "I-45/001.png", bytes.substr(0, bytes.size() / 2));
  EXPECT_SAYS(Complaint(), "I-45/001.png");
  EXPECT_SAYS(Complaint(), "cut off");
}

TEST_F(InputTest, APictureOfAnotherKindIsNotGivenToWhoeverKnowsIt) {
  WriteFileAtomically(folder_ / "a.tif", std::string("GDAL or whatever") + std::string(200, 'x'));
  EXPECT_THROW(ReadPicture(folder_ / "a.tif"), Error);
  WriteFileAtomically(folder_ / "b.tif", EncodeJpeg(Image<Rgb8>(8, 8), 90));  // whatever it is called
  EXPECT_EQ(ReadPicture(folder_ / "b.tif").width(), 8);
}

TEST_F(InputTest, APictureThatPromisesMoreThanItsFileCanHoldIsRefused) {
  std::string bytes = EncodeJpeg(Image<Rgb8>(8, 8), 90);
  const std::size_t size = bytes.find("\xFF\xC0") + 5;  // height, width
  bytes[size] = bytes[size + 2] = 0x20;
  WriteFileAtomically(folder_ / "a.jpg", bytes);
  try {
    ReadPicture(folder_ / "a.jpg");
    FAIL();
  } catch (const Error& error) {
    EXPECT_SAYS(std::string(error.what()), "promises more pixels");
  }
}

// What is left of these files cannot be decoded: that it is not tried is seen in the message.
TEST_F(InputTest, APromiseOfTooManyPixelsIsFoundBeforeMemoryIsTakenForThem) {
  std::string jpeg = EncodeJpeg(Image<Rgb8>(8, 8), 90);
  const std::size_t size = jpeg.find("\xFF\xC0") + 5;
  jpeg[size] = jpeg[size + 2] = 0x20;
  WriteFileAtomically(folder_ / "a.jpg", jpeg.substr(0, size + 12) + "\xFF\xD9");
  WritePng(folder_ / "b.png", Image<std::uint8_t>(8, 8));
  std::string png = ReadFile(folder_ / "b.png");
  png[18] = png[22] = 0x20;
  WriteFileAtomically(folder_ / "b.png", png);  // its checksum is wrong now
  const auto tag = [](int number, int value) {  // of a TIFF, one long
    const auto u = [](int n) { return std::string{char(n), char(n >> 8), char(n >> 16), char(n >> 24)}; };
    return u(number).substr(0, 2) + u(4).substr(0, 2) + u(1) + u(value);
  };
  WriteFileAtomically(folder_ / "c.tif", std::string("II*\0\x08\0\0\0\x04\0", 10) + tag(256, 100'000'000) +
                                             tag(257, 7) + tag(273, 8) + tag(279, 4) + std::string(4, '\0'));
  for (const char* name : {"a.jpg", "b.png", "c.tif"}) {
    try {
      ReadPicture(folder_ / name);
      FAIL();
    } catch (const Error& error) {
      EXPECT_SAYS(std::string(error.what()), "promises more pixels");
    }
  }
}

TEST_F(InputTest, AWrongLayoutIsNamed) {
  Grey8("mosaic/a.png");
  EXPECT_SAYS(Complaint({.layout = "90 45 / 135 30"}), "\"90 45 / 135 30\"");
  EXPECT_SAYS(Complaint({.layout = "sony"}), "not a mosaic layout");
  EXPECT_EQ(Complaint({.layout = "90 45 / 135 0"}), "");
}

TEST_F(InputTest, WhatIsAmbiguousAsksForTheOptionThatDecides) {
  Grey8("a.png");
  EXPECT_SAYS(Complaint(), "--input-kind");
  EXPECT_EQ(Complaint({.kind = "photos"}), "");
  EXPECT_SAYS(Complaint({.kind = "mosaic"}), "--layout");
  EXPECT_EQ(Complaint({.kind = "mosaic", .layout = "90 45 / 135 0"}), "");
  EXPECT_EQ(Open({.layout = "90 45 / 135 0"}).kind, InputKind::kMosaic);  // only mosaics have a layout
}

TEST_F(InputTest, SixteenBitMosaicsAskForTheirDepth) {
  Grey16("mosaic/a.png", 60000);
  EXPECT_SAYS(Complaint({.layout = "90 45 / 135 0"}), "--bits");
  EXPECT_SAYS(Complaint({.layout = "90 45 / 135 0", .bits = 12}), "60000 does not fit in 12 bits");
  EXPECT_EQ(Complaint({.layout = "90 45 / 135 0", .bits = 16}), "");
}

TEST_F(InputTest, SixteenBitAnglePicturesAreAskedForTheirDepthUnlessTheyShowIt) {
  for (const char* angle : {"0", "45", "90", "135"}) Grey16(std::string(angle) + "/a.png", 4000);
  EXPECT_SAYS(Complaint(), "--bits");
  Grey16("90/a.png", 40000);
  const Input input = Open();
  EXPECT_EQ(input.sensor.white_dn, 65535);
  EXPECT_SAYS(input.notes.at(0), "--bits");
}

TEST_F(InputTest, SeveralKindsInOneFolderAskWhichToUse) {
  Angles({"000"});
  Floats("stokes/a.tif", 4);
  EXPECT_SAYS(Complaint(), "--input-kind angles");
  EXPECT_EQ(Complaint({.kind = "stokes"}), "");
}

TEST_F(InputTest, KeysThatAreNearlyRightAreNamed) {
  Grey8("mosaic/a.png");
  Set(R"({"seed": 3, "sensr": 1, "sensor": {"layout": "90 45 / 135 0", "blackdn": 60, "pixel_um": 3.45}})");
  const std::vector<std::string> warnings = Open().warnings;
  ASSERT_EQ(warnings.size(), 1u) << fmt::format("{}", fmt::join(warnings, "; "));
  EXPECT_NE(warnings[0].find("\"blackdn\" means nothing here; is \"black_dn\" meant?"), std::string::npos);
}

TEST_F(InputTest, AFolderOfMasksMayBeginWithACapital) {
  Grey8("mosaic/a.png");
  for (const char* name : {"Masks", "mask"}) {
    WritePng(folder_ / name / "a.png", Image<std::uint8_t>(8, 6, 255));
    InputOptions options;
    options.layout = "90 45 / 135 0";
    EXPECT_TRUE(Open(options).views[0].mask.has_value()) << name;
    fs::remove_all(folder_ / name);
  }
}

TEST_F(InputTest, AMosaicOfHalfCellsAndAFolderGivenTwiceAreNamed) {
  Grey8("mosaic/a.png", 9, 6);
  InputOptions options;
  options.layout = "90 45 / 135 0";
  EXPECT_SAYS(Complaint(options), "9x6 pixels does not consist of whole 2x2 cells");
  Grey8("mosaic/a.png");
  Progress progress;
  try {
    OpenInputs({folder_, folder_ / "mosaic" / ".."}, options, progress);
    FAIL() << "no error was thrown";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("given twice"), std::string::npos) << error.what();
  }
}

// A grey 8-bit TIFF of one strip with the tag Orientation, written by hand.
std::string TiffWithOrientation(const Image<std::uint8_t>& image, std::uint16_t orientation, bool big) {
  std::string bytes = big ? "MM" : "II";
  const auto put = [&](std::uint32_t value, int count) {
    for (int i = 0; i < count; ++i) bytes += char(value >> 8 * (big ? count - 1 - i : i));
  };
  put(42, 2), put(std::uint32_t(8 + image.size()), 4);
  for (const std::uint8_t pixel : image.pixels()) bytes += char(pixel);
  const std::pair<std::uint16_t, std::uint32_t> entries[] = {{256, image.width()},
                                                             {257, image.height()},
                                                             {258, 8},
                                                             {259, 1},
                                                             {262, 1},
                                                             {273, 8},
                                                             {274, orientation},
                                                             {277, 1},
                                                             {278, image.height()},
                                                             {279, std::uint32_t(image.size())}};
  put(std::size(entries), 2);
  for (const auto& [tag, value] : entries) {
    const bool is_long = tag == 273 || tag == 279;
    put(tag, 2), put(is_long ? 4 : 3, 2), put(1, 4);
    put(value, is_long ? 4 : 2);
    if (!is_long) put(0, 2);
  }
  put(0, 4);
  return bytes;
}

TEST_F(InputTest, TiffIsReadAsItIsStoredWhateverItsOrientationSays) {
  Image<std::uint8_t> image(8, 6);
  for (std::size_t i = 0; i < image.size(); ++i) image.pixels()[i] = std::uint8_t(5 * i);
  for (const bool big : {false, true})
    for (std::uint16_t orientation = 1; orientation <= 8; ++orientation) {
      WriteFileAtomically(folder_ / "a.tif", TiffWithOrientation(image, orientation, big));
      const Picture picture = ReadPicture(folder_ / "a.tif");
      ASSERT_EQ(picture.width(), 8) << orientation;
      for (std::size_t i = 0; i < image.size(); ++i)
        ASSERT_EQ(picture.planes[0].pixels()[i], float(image.pixels()[i])) << orientation << " " << i;
      EXPECT_EQ(ReadPictureTags(folder_ / "a.tif").orientation, orientation);
    }
}

TEST_F(InputTest, AMaskOfAnotherSizeIsNamed) {
  Angles({"000"});
  Grey8("masks/000.png", 8, 7);
  EXPECT_SAYS(Complaint(), "the mask is 8x7, its picture 8x6");
  EXPECT_SAYS(Complaint(), "masks/000.png");
}

TEST_F(InputTest, MasksThatMatchNoViewAreAnError) {
  Angles({"000"});
  Grey8("masks/view000.png");
  EXPECT_SAYS(Complaint(), "no mask has the name of a view");
  EXPECT_SAYS(Complaint(), "000.png, not view000.png");
}

TEST_F(InputTest, ABadSetJsonIsNamed) {
  Grey8("mosaic/a.png");
  Set("{");
  EXPECT_SAYS(Complaint(), "set.json");
  EXPECT_SAYS(Complaint(), "it ends too early: it was cut off");
  Set(" ");
  EXPECT_SAYS(Complaint(), "it is empty");
  Set("{\n  \"sensor\": nothing\n}");
  EXPECT_SAYS(Complaint(), "line 2, column 14: what stands there (othing) does not belong there");
  Set(R"({"sensor": {"bits": "twelve"}})");
  EXPECT_SAYS(Complaint(), "\"bits\" must be a number");
  for (const char* bits : {"1e24", "0", "11.5"}) {
    Set(fmt::format(R"({{"sensor": {{"bits": {}}}}})", bits));
    EXPECT_SAYS(Complaint(), "\"bits\" must be a whole number from 1 to 32");
  }
  for (const char* absurd : {"gamma\": 1e-9", "gamma\": -1", "white_dn\": -4", "dn_per_e\": 1e300",
                             "black_dn\": -1", "read_noise_e\": -2"}) {
    Set(fmt::format(R"({{"sensor": {{"layout": "90 45 / 135 0", "{}}}}})", absurd));
    EXPECT_SAYS(Complaint(), "must be a number from");
  }
  Set(R"({"input_kind": "video"})");
  EXPECT_SAYS(Complaint(), "input-kind video");
  Set(R"({"sensor": {"layout": "90 45 / 135 0", "black_dn": 300}})");
  EXPECT_SAYS(Complaint(), "black level 300 is not below");
}

TEST_F(InputTest, AFourthPageWithValuesBelow0IsNoNoise) {
  const Image<float> page(8, 6, 0.5f), circular(8, 6, -0.01f);
  WriteFloatTiff(folder_ / "a.tif", {&page, &page, &page, &circular});
  EXPECT_SAYS(Complaint(), "the fourth page is the noise");
}

TEST_F(InputTest, StokesPicturesMustBeFloatingPoint) {
  for (const char* name : {"v_s0.png", "v_s1.png", "v_s2.png"}) Grey16(name, 5);
  EXPECT_SAYS(Complaint(), "floating point");
  fs::remove(folder_ / "v_s1.png");
  EXPECT_SAYS(Complaint(), "*_s1 lacks v");
}

TEST_F(InputTest, TwoFilesForOneViewAreAnError) {
  Colour("a.png");
  fs::copy_file(folder_ / "a.png", folder_ / "a.tiff");
  EXPECT_SAYS(Complaint(), "two pictures have the same name");
}

TEST_F(InputTest, AMosaicCannotBeDeclaredClockwise) {
  Grey8("mosaic/a.png");
  EXPECT_SAYS(Complaint({.layout = "90 45 / 135 0", .aop_sense = "clockwise"}), "Swap 45 and 135");
}

TEST(SharedInput, EveryFormOfTheSharedDataIsRecognized) {
  const fs::path data = fs::path(POLARSCAN_SHARED) / "data";
  if (!fs::exists(data / "rendered/igea-table") || !fs::exists(data / "multiview-polar/wwbottle60"))
    GTEST_SKIP() << "../shared/data is not there";
  const Input igea = OpenInput(data / "rendered/igea-table", {});
  EXPECT_EQ(igea.kind, InputKind::kMosaic);
  EXPECT_EQ(igea.views.size(), 18u);
  EXPECT_EQ(igea.sensor.white_dn, 4000);
  EXPECT_FALSE(igea.known_model);
  const Input bunny = OpenInput(data / "rendered/bunny-plastic", {});
  EXPECT_EQ(bunny.kind, InputKind::kAngles);
  EXPECT_EQ(bunny.views.size(), 36u);
  EXPECT_TRUE(bunny.known_model);
  EXPECT_TRUE(bunny.views[35].mask);
  const Input bottle = OpenInput(data / "multiview-polar/wwbottle60", {});
  EXPECT_EQ(bottle.kind, InputKind::kAngles);
  EXPECT_EQ(bottle.views.size(), 60u);
  EXPECT_EQ(ReadView(bottle, 0).pictures[0].planes.size(), 3u);
}

}  // namespace
}  // namespace polarscan
