// SPDX-License-Identifier: Apache-2.0
// What masks do to the features that poses are taken from.
#include "stereo/sfm/features/feature_masks.h"

#include "core/random.h"
#include "helpers.h"
#include "stereo/sfm/alignment.h"

namespace polarscan {
namespace {

// Two groups of features in each of `count` pictures, outside and inside of the masks, all matched with their
// likes in all other pictures: those move from picture to picture by so many px.
struct Scene {
  double outside_moves = 0, inside_moves = 10;
  int count = 6, outside = 30, inside = 20;

  static std::string Name(int i) { return std::to_string(i) + ".png"; }
  FeaturePlaces Places() const {
    FeaturePlaces places;
    Random random(3);
    std::vector<Eigen::Vector2f> start;
    for (int k = 0; k < outside + inside; ++k)
      start.emplace_back(float(600 * random.Uniform()), float(400 * random.Uniform()));
    for (int i = 0; i < count; ++i)
      for (int k = 0; k < outside + inside; ++k)
        places[Name(i)].push_back(
            start[std::size_t(k)] +
            Eigen::Vector2f(float(i * (k < outside ? outside_moves : inside_moves)), 0));
    return places;
  }
  std::vector<PictureMatches> Matches() const {
    std::vector<PictureMatches> all;
    for (const auto& [i, j] : AllPairs(count)) {
      all.push_back({Name(i), Name(j), {}});
      for (int k = 0; k < outside + inside; ++k) all.back().features.emplace_back(k, k);
    }
    return all;
  }
  FeatureFlags Inside() const {
    FeatureFlags flags;
    for (int i = 0; i < count; ++i)
      for (int k = 0; k < outside + inside; ++k) flags[Name(i)].push_back(k >= outside);
    return flags;
  }
  Stillness Measure() const { return MeasureStillness(Places(), Matches(), Inside(), 640); }
};

TEST(StillBackground, IsKnownByItsFeaturesThatDoNotMove) {
  const Stillness found = Scene().Measure();
  EXPECT_TRUE(found.IsBackground());
  EXPECT_EQ(found.pairs, 15);
  EXPECT_EQ(found.still, 15);
  EXPECT_EQ(std::ranges::count(found.features.at("2.png"), true), 30);
  EXPECT_FALSE(found.features.at("2.png")[30]) << "inside of the mask";
}

TEST(StillBackground, ATableThatTurnsAlongStays) {
  FeaturePlaces places = Scene().Places();
  for (auto& [name, all] : places)
    for (int k = 0; k < 12; ++k) all[std::size_t(k)].x() += float(9 * std::stoi(name));
  const Stillness found = MeasureStillness(places, Scene().Matches(), Scene().Inside(), 640);
  EXPECT_TRUE(found.IsBackground());
  EXPECT_FALSE(found.features.at("2.png")[11]);
  EXPECT_TRUE(found.features.at("2.png")[12]);
}

TEST(StillBackground, IsNotFoundWhereTheCameraGoesRoundTheObject) {
  const Stillness found = Scene{.outside_moves = 25}.Measure();
  EXPECT_EQ(found.pairs, 15);
  EXPECT_EQ(found.still, 0);
  EXPECT_FALSE(found.IsBackground());
}

TEST(StillBackground, PicturesOfOnePlaceAreNoSignOfIt) {
  const Stillness found = Scene{.inside_moves = 0}.Measure();
  EXPECT_EQ(found.pairs, 0);
  EXPECT_FALSE(found.IsBackground());
}

TEST(StillBackground, FewMatchesAreNoSignOfIt) {
  EXPECT_FALSE(Scene{.outside = 14}.Measure().IsBackground());
}

// A smooth random field with details of size 1.
double Noise(const Eigen::Vector3d& p) {
  const Eigen::Vector3d cell = p.array().floor(), t = p - cell;
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1;
    std::uint64_t key = 1;
    for (int k = 0; k < 3; ++k) {
      const int up = corner >> k & 1;
      weight *= up ? t[k] : 1 - t[k];
      key = key * 0x9e3779b97f4a7c15u + std::uint64_t(std::int64_t(cell[k]) + up);
    }
    sum += weight * Random(key).Uniform();
  }
  return sum;
}

double Texture(const Eigen::Vector3d& p) {
  return 0.4 * Noise(p) + 0.35 * Noise(2.1 * p) + 0.25 * Noise(4.3 * p);
}

// Pictures of a textured ball that turns before a wall that stands still, with masks, as a folder of views.
class Turntable : public FolderTest {
 protected:
  static constexpr int kViews = 8;
  void SetUp() override {
    FolderTest::SetUp();
    if (!HasColmap()) GTEST_SKIP() << "COLMAP is not installed";
    std::vector<DenseView> ring = Ring(24, 4, 25);
    views.assign(ring.begin(), ring.begin() + kViews);
    for (DenseView& view : views) view.camera = {320, 256, 400, 400, 160, 128};
    WriteViews(folder / "views", views);
    for (const DenseView& view : views) WritePicture(view);
  }
  void WritePicture(const DenseView& view) const {
    Image<std::uint8_t> picture(320, 256), mask(320, 256);
    const Eigen::Vector3d centre = view.cam_from_world * Eigen::Vector3d::Zero();
    for (int y = 0; y < 256; ++y)
      for (int x = 0; x < 320; ++x) {
        const Eigen::Vector3d ray = view.camera.Ray(x + 0.5, y + 0.5).normalized();
        const double near = ray.dot(centre), inside = near * near - centre.squaredNorm() + 1;
        const bool hit = inside > 0;
        const Eigen::Vector3d place =
            view.cam_from_world.Inverse() * Eigen::Vector3d(ray * (near - std::sqrt(inside)));
        const double value = hit ? Texture(8 * place) : Texture(Eigen::Vector3d(x / 18.0, y / 18.0, 0));
        picture(x, y) = std::uint8_t(255 * value);
        mask(x, y) = hit ? 255 : 0;
      }
    WritePng(folder / "views" / (view.name + ".png"), picture);
    WritePng(folder / "views/masks" / (view.name + ".png"), mask);
  }
  SparseModel Run() { return EstimatePoses(folder / "views", folder / "sfm", {}, options, progress); }
  void ExpectTruePoses(const SparseModel& model) const {
    ASSERT_EQ(model.images.size(), std::size_t(kViews));
    std::vector<NamedPose> truth;
    for (const DenseView& view : views) truth.push_back({view.name, view.cam_from_world});
    EXPECT_LT(AlignCameras(Poses(model), truth).errors.rms, 0.05);
  }

  std::vector<DenseView> views;
  SfmOptions options;
  Listener progress;
};

TEST_F(Turntable, PosesComeFromTheObjectThatTurnsBeforeAStillWall) {
  CreateFolder(folder / "views/masks");
  ExpectTruePoses(Run());
  EXPECT_TRUE(progress.warnings.empty()) << progress.warnings.front();
  EXPECT_TRUE(
      progress.HeardInfo("the background stands still in 28 of 28 pairs of pictures (--sfm-masks auto)"));
}

TEST_F(Turntable, MasksOnlyAreUsedIfAskedForAlsoAfterAnotherRun) {
  options.masks = "no";
  try {
    Run();  // COLMAP may settle for the wall or for the ball
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find("too few"), std::string::npos) << error.what();
  }
  options.masks = "yes";
  ExpectTruePoses(Run());
}

}  // namespace
}  // namespace polarscan
