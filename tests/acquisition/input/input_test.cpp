// SPDX-License-Identifier: Apache-2.0
// What is found in a folder of pictures, and what it means.
#include "acquisition/input/input.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "core/random.h"
#include "input/input_folder.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

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
