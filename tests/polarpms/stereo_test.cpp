// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/stereo.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>
#include <optional>
#include <set>
#include <thread>

#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "stereo/costs/hull.h"
#include "stereo/dense/load_view.h"
#include "stereo/map_io.h"
#include "stereo/search/continuous.h"
#include "stereo/search/filter.h"
#include "stereo/workspace.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;
constexpr int kWidth = 96, kHeight = 80, kViews = 6;
constexpr double kDistance = 4, kRadius = 1;

// z-depth at which the ray meets the unit sphere at the world's origin.
std::optional<double> SphereDepth(const DenseView& view, const Eigen::Vector3d& ray) {
  const Eigen::Vector3d center = view.cam_from_world * Eigen::Vector3d::Zero();
  const double a = ray.squaredNorm(), b = ray.dot(center), c = center.squaredNorm() - kRadius * kRadius;
  if (b * b < a * c) return std::nullopt;
  return (b - std::sqrt(b * b - a * c)) / a;
}

double Texture(const Eigen::Vector3d& p) {
  return 1 + 0.3 * std::sin(9 * p.x() + 2 * p.y()) + 0.3 * std::cos(8 * p.y() - 3 * p.z()) +
         0.2 * std::sin(11 * p.z());
}

// A sphere seen from six places of a ring, textured or not, with diffuse polarization along its azimuths.
class Sphere : public testing::Test {
 protected:
  Sphere() : folder_(fs::path(testing::TempDir()) / ("sphere." + std::to_string(::getpid()))) {
    fs::remove_all(folder_);
  }
  ~Sphere() override { fs::remove_all(folder_); }

  void Write(bool textured) {
    workspace_.folder = folder_;
    workspace_.polarized = true;
    for (int i = 0; i < kViews; ++i) {
      DenseView view{"v" + std::to_string(i),
                     {kWidth, kHeight, 130, 130, kWidth / 2.0, kHeight / 2.0},
                     {},
                     2.5,
                     5.5,
                     {}};
      const double angle = 0.3 * (i - 2.5);
      view.cam_from_world.rotation = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
      view.cam_from_world.translation = {0, 0, kDistance};
      for (int j = 0; j < kViews; ++j)
        if (j != i) view.sources.push_back(j);
      std::ranges::sort(view.sources, {}, [&](int j) { return std::abs(j - i); });
      workspace_.views.push_back(view);
      WriteView(i, textured);
    }
    WriteWorkspace(workspace_);
  }

  void WriteView(int index, bool textured) {
    const DenseView& view = workspace_.views[std::size_t(index)];
    const Image<float> blank(kWidth, kHeight);
    StokesImage stokes{blank, blank, blank, Image<float>(kWidth, kHeight, 1e-4f)};
    Image<std::uint8_t> mask(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const Eigen::Vector3d ray = view.camera.Ray(x + 0.5, y + 0.5);
        const auto depth = SphereDepth(view, ray);
        if (!depth) continue;
        const Eigen::Vector3d p = view.cam_from_world.Inverse() * (*depth * ray),
                              n = view.cam_from_world.rotation * p;
        const double alpha = std::atan2(-(n.y() - n.z() * ray.y()), n.x() - n.z() * ray.x());
        const double cosine = -n.dot(ray.normalized()), dop = 0.2 * (1 - cosine);
        mask(x, y) = 255;
        stokes.s0(x, y) = float(textured ? 0.5 * Texture(p) : 0.8);
        stokes.s1(x, y) = float(stokes.s0(x, y) * dop * std::cos(2 * alpha));
        stokes.s2(x, y) = float(stokes.s0(x, y) * dop * std::sin(2 * alpha));
      }
    if (spoil_) spoil_(stokes);
    WriteStokes(workspace_.StokesPath(index), stokes);
    WritePng(workspace_.MaskPath(index), mask);
  }

  struct Errors {
    double median_depth = 0, median_normal_deg = 0, estimated = 0;
  };
  // Over the pixels of all views, a missing one counted as 1 and 90 degrees.
  Errors Compare(const MapKind& kind = kFinalMaps) const {
    std::vector<double> depths, normals;
    double estimated = 0;
    for (int i = 0; i < kViews; ++i) {
      const DenseView& view = workspace_.views[std::size_t(i)];
      const Image<float> depth = ReadDepthMap(workspace_.DepthPath(i, kind));
      const Image<Eigen::Vector3f> normal = ReadNormalMap(workspace_.NormalPath(i, kind));
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const Eigen::Vector3d ray = view.camera.Ray(x + 0.5, y + 0.5);
          const auto truth = SphereDepth(view, ray);
          if (!truth) continue;
          const Eigen::Vector3d n = *truth * ray - view.cam_from_world * Eigen::Vector3d::Zero();
          const bool there = depth(x, y) > 0;
          estimated += there;
          depths.push_back(there ? std::abs(depth(x, y) - *truth) : 1);
          const double cosine = normal(x, y).cast<double>().dot(n);
          normals.push_back(there ? std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi : 90);
        }
    }
    const double count = double(depths.size());
    std::ranges::sort(depths);
    std::ranges::sort(normals);
    return {depths[depths.size() / 2], normals[normals.size() / 2], estimated / count};
  }

  static StereoOptions Quick(const std::string& preset) {
    StereoOptions options = StereoPreset(preset);
    options.photometric_iterations = 2;
    options.geometric_iterations = 1;
    options.window_radius = 3;
    options.window_step = 1;
    options.filter = false;
    options.surfaces = 0;
    return options;
  }

  std::string AllBytes() const {
    std::string bytes;
    for (int i = 0; i < kViews; ++i)
      bytes += ReadFile(workspace_.DepthPath(i, kFinalMaps)) + ReadFile(workspace_.NormalPath(i, kFinalMaps));
    return bytes;
  }

  fs::path folder_;
  std::function<void(StokesImage&)> spoil_;  // of every view, before it is written
  Workspace workspace_;
  Progress progress_;
};

TEST_F(Sphere, DefaultPresetFindsDepthAndNormalsOfATexturedSphere) {
  Write(true);
  EstimateMaps(folder_, Quick("default"), progress_);
  const Errors errors = Compare();
  EXPECT_LT(errors.median_depth, 3.0 / 130);  // one pixel's width on the sphere
  EXPECT_LT(errors.median_normal_deg, 6);
}

TEST_F(Sphere, PolarizationGivesTheNormalsThatTextureDoesNot) {
  Write(false);
  StereoOptions options = Quick("default");
  EstimateMaps(folder_, options, progress_);
  const Errors with = Compare();
  options.polarization = false;
  EstimateMaps(folder_, options, progress_);
  EXPECT_LT(with.median_normal_deg, 0.5 * Compare().median_normal_deg);
}

TEST_F(Sphere, PaperPresetWithoutItsTermsIsPlainPatchMatchAndWorksOnTexture) {
  Write(true);
  StereoOptions options = Quick("paper");
  options.polarization = options.depth_normal = false;
  EstimateMaps(folder_, options, progress_);
  EXPECT_LT(Compare().median_depth, 0.02);
}

TEST_F(Sphere, RivalsFindDepthAndNormalsOfATexturedSphere) {
  Write(true);
  for (const char* preset : {"colmap", "acmmp", "polarimetric-mvs"}) {
    StereoOptions options = Quick(preset);
    options.geometric_iterations = 2;
    options.sigma_color = 0.2;  // acmmp's is for finer textures
    EstimateMaps(folder_, options, progress_);
    const Errors errors = Compare();
    EXPECT_LT(errors.median_depth, 3.0 / 130) << preset;
    EXPECT_LT(errors.median_normal_deg, 20) << preset;
    EXPECT_EQ(errors.estimated, 1) << preset;
  }
}

TEST_F(Sphere, ContinuousRefinementFindsTheDepthsThatMatchBest) {
  Write(true);
  StereoOptions options = Quick("colmap");
  options.continuous_iterations = 20;
  const auto view = [&](int i) {
    return std::make_shared<StereoView>(LoadStereoView(workspace_, i, 1, options));
  };
  const auto reference = view(2);
  Problem problem{reference.get(), {}, 2.5f, 5.5f, 2};
  for (int i : {1, 3}) problem.sources.push_back(MakeSource(*reference, view(i), nullptr));
  DepthNormalMap map{Image<float>(kWidth, kHeight), Image<Eigen::Vector3f>(kWidth, kHeight)};
  const DenseView& dense = workspace_.views[2];
  const auto errors = [&] {  // of depths, in the middle of the sphere
    double sum = 0, count = 0;
    for (int y = 30; y < 50; ++y)
      for (int x = 38; x < 58; ++x, ++count)
        sum += std::abs(map.depth(x, y) - *SphereDepth(dense, dense.camera.Ray(x + 0.5, y + 0.5)));
    return sum / count;
  };
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const Eigen::Vector3d ray = dense.camera.Ray(x + 0.5, y + 0.5);
      if (const auto depth = SphereDepth(dense, ray)) {
        map.depth(x, y) = float(*depth * (1 + 0.01 * ((x + y) % 2 ? 1 : -1)));
        map.normal(x, y) = Eigen::Vector3d(*depth * ray - Eigen::Vector3d(0, 0, kDistance)).cast<float>();
      }
    }
  const double before = errors();
  RefineContinuously(problem, options, std::vector<float>(2 * map.depth.size(), 0.5f), map, progress_);
  EXPECT_LT(errors(), 0.5 * before);
}

TEST_F(Sphere, PolarizationThatIsWrongInAllViewsIsFoundAndCorrected) {
  struct Case {
    PolarizationCorrection wrong;  // what is done to the pictures
    PolarizationCorrection cure;
  };
  const StereoOptions options = Quick("default");
  Write(true);
  EstimateMaps(folder_, options, progress_);
  EXPECT_EQ(ReadWorkspace(folder_).correction, PolarizationCorrection());  // nothing is wrong
  const Errors right = Compare();
  for (const auto& [wrong, cure] : {Case{{12, false, 0, 0}, {-12, false, 0, 0}},
                                    {{0, true, 0, 0}, {0, true, 0, 0}},
                                    {{0, false, -0.03, 0.02}, {0, false, 0.03, -0.02}}}) {
    spoil_ = [&wrong = wrong](StokesImage& image) { Correct(wrong, image); };
    fs::remove_all(folder_);
    workspace_ = {};
    Write(true);
    EstimateMaps(folder_, options, progress_);
    const PolarizationCorrection found = ReadWorkspace(folder_).correction;
    EXPECT_NEAR(found.turn_deg, cure.turn_deg, 2);
    EXPECT_EQ(found.mirrored, cure.mirrored);
    EXPECT_NEAR(found.bias_s1, cure.bias_s1, 0.01);  // of degrees of polarization up to 0.2
    EXPECT_NEAR(found.bias_s2, cure.bias_s2, 0.01);
    const double corrected = Compare().median_normal_deg;
    StereoOptions as_given = options;
    as_given.fit_polarization = false;
    EstimateMaps(folder_, as_given, progress_);
    EXPECT_EQ(ReadWorkspace(folder_).correction,
              PolarizationCorrection());  // nothing is left of the other run
    EXPECT_LT(corrected, (right.median_normal_deg + Compare().median_normal_deg) / 2);
  }
}

TEST_F(Sphere, ADamagedCorrectionIsNamed) {
  Write(true);
  CreateFolder(folder_ / "stereo");
  WriteFileAtomically(folder_ / "stereo/polarization.json", "{\"turn_deg\": 1}");
  try {
    ReadWorkspace(folder_);
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_NE(e.where().find("polarization.json"), std::string::npos) << e.what();
  }
}

TEST_F(Sphere, OneAndTwoThreadsGiveTheSameBytes) {
  Write(true);
  for (const char* preset : {"default", "paper", "acmmp", "polarimetric-mvs"}) {
    StereoOptions options = Quick(preset);
    options.continuous_iterations = 2;
    std::string bytes[2];
    for (int threads : {1, 2}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
      fs::remove_all(folder_ / "stereo");
      EstimateMaps(folder_, options, progress_);
      bytes[threads - 1] = AllBytes();
    }
    EXPECT_TRUE(bytes[0] == bytes[1]) << preset;
  }
}

TEST_F(Sphere, FilterKeepsMostOfATexturedSphereAndDropsPixelsWithoutAnyCue) {
  Write(true);
  StereoOptions options = Quick("default");
  options.filter = true;
  EstimateMaps(folder_, options, progress_);
  EXPECT_GT(Compare().estimated, 0.65);
  options.filter_min_dop = 1;
  options.filter_min_variance = 65025;
  EstimateMaps(folder_, options, progress_);
  EXPECT_EQ(Compare().estimated, 0);
}

TEST_F(Sphere, PhotographsWithoutMasksMustMatchThoughAllViewsAgree) {
  Write(true);
  StereoOptions options;
  options.polarization = options.masks = false;
  const auto view = [&](int i) {
    return std::make_shared<StereoView>(LoadStereoView(workspace_, i, 1, options));
  };
  const auto reference = view(2);
  Problem problem{reference.get(), {}, 2.5f, 5.5f, 2};
  for (int i = 0; i < kViews; ++i)
    if (i != 2) problem.sources.push_back(MakeSource(*reference, view(i), nullptr));
  const auto share_kept = [&](double factor) {
    DepthNormalMap map{Image<float>(kWidth, kHeight),
                       Image<Eigen::Vector3f>(kWidth, kHeight, Eigen::Vector3f::Zero())};
    double count = 0, kept = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const Eigen::Vector3d ray = reference->camera.Ray(x + 0.5, y + 0.5);
        const auto depth = SphereDepth(workspace_.views[2], ray);
        if (!depth) continue;
        map.depth(x, y) = float(factor * *depth), ++count;
        map.normal(x, y) = (*depth * ray - Eigen::Vector3d(0, 0, kDistance)).cast<float>();
      }
    FilterBySupport(problem, options, Image<float>(kWidth, kHeight, 10), map);
    for (const float depth : map.depth.pixels()) kept += depth > 0;
    return kept / count;
  };
  EXPECT_GT(share_kept(1), 0.7);
  EXPECT_LT(share_kept(0.9), 0.2);
}

TEST_F(Sphere, GoesOnAfterACancelAndRepairsADamagedMap) {
  Write(true);
  EstimateMaps(folder_, Quick("default"), progress_);
  const std::string undisturbed = AllBytes();
  fs::remove_all(folder_ / "stereo");
  struct StopAtThirdView : Progress {
    void Advance(std::size_t) override {
      if (++views == 3) Cancel();
    }
    int views = 0;
  } stop;
  EXPECT_THROW(EstimateMaps(folder_, Quick("default"), stop), Cancelled);
  EXPECT_TRUE(fs::exists(workspace_.DepthPath(2, MapKind{MapStage::kStep, 0})));
  EXPECT_FALSE(fs::exists(workspace_.DepthPath(4, MapKind{MapStage::kStep, 0})));
  std::ofstream(workspace_.DepthPath(1, MapKind{MapStage::kStep, 0}), std::ios::trunc) << "damage";
  std::ofstream(workspace_.NormalPath(1, MapKind{MapStage::kStep, 77})) << "of other options, killed";
  EstimateMaps(folder_, Quick("default"), progress_);
  EXPECT_TRUE(AllBytes() == undisturbed);
  EXPECT_FALSE(fs::exists(workspace_.DepthPath(1, MapKind{MapStage::kStep, 0}))) << "left over";
  EXPECT_FALSE(fs::exists(workspace_.NormalPath(1, MapKind{MapStage::kStep, 77}))) << "left over";
  std::ofstream(workspace_.NormalPath(1, kFinalMaps), std::ios::trunc) << "damage";
  EstimateMaps(folder_, Quick("default"), progress_);
  EXPECT_TRUE(AllBytes() == undisturbed);
}

TEST_F(Sphere, PolarimetricMvsGoesOnAfterACancelAndItsFilterKeepsWhatContoursReached) {
  Write(true);
  StereoOptions options = Quick("polarimetric-mvs");
  EstimateMaps(folder_, options, progress_);
  const std::string undisturbed = AllBytes();
  fs::remove_all(folder_ / "stereo");
  struct StopInPropagation : Progress {
    void Advance(std::size_t) override {
      if (++views == 2 * kViews + 3) Cancel();
    }
    int views = 0;
  } stop;
  EXPECT_THROW(EstimateMaps(folder_, options, stop), Cancelled);
  EXPECT_TRUE(fs::exists(workspace_.DepthPath(2, kFinalMaps)));
  EXPECT_FALSE(fs::exists(workspace_.DepthPath(4, kFinalMaps)));
  EstimateMaps(folder_, options, progress_);
  EXPECT_TRUE(AllBytes() == undisturbed);
  EXPECT_FALSE(fs::exists(workspace_.DepthPath(1, MapKind{MapStage::kStep, 1}))) << "left over";
  options.filter = true;
  EstimateMaps(folder_, options, progress_);
  EXPECT_GT(Compare().estimated, 0.8);
  options.filter_min_variance = 65025;  // no point has so much texture
  EstimateMaps(folder_, options, progress_);
  EXPECT_EQ(Compare().estimated, 0);
}

TEST_F(Sphere, VisualHullOfItsSilhouettesContainsTheSurface) {
  Write(true);
  StereoOptions options;
  std::vector<StereoView> views;
  for (int i = 0; i < kViews; ++i) views.push_back(LoadStereoView(workspace_, i, 1, options));
  Problem problem{&views[0], {}, 2.5f, 5.5f, 0};
  std::vector<Source> silhouettes;
  for (int i = 1; i < kViews; ++i)
    silhouettes.push_back(MakeSource(views[0], std::make_shared<StereoView>(views[std::size_t(i)]), nullptr));
  const Image<DepthInterval> hull = VisualHull(problem, silhouettes);
  double width = 0, count = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      if (const auto depth = SphereDepth(workspace_.views[0], views[0].camera.Ray(x + 0.5, y + 0.5))) {
        EXPECT_LE(hull(x, y).near_depth, *depth);
        EXPECT_GE(hull(x, y).far_depth, *depth);
        width += hull(x, y).far_depth - hull(x, y).near_depth, count += 1;
      }
  EXPECT_LT(width / count, 2.6);  // narrower than the whole range of 3
}

TEST_F(Sphere, ShardsMakeTheSameBytesAsOneProgram) {
  for (const char* preset : {"default", "paper", "acmmp", "polarimetric-mvs"}) {
    Write(true);
    EstimateMaps(folder_, Quick(preset), progress_);
    const std::string alone = AllBytes();
    fs::remove_all(folder_ / "stereo");
    std::vector<std::jthread> shards;
    for (int i : {1, 0, 2})
      shards.emplace_back([&, i] {
        Progress progress;
        EstimateMaps(folder_, Quick(preset), progress, {i, 3, 60});
      });
    shards.clear();
    EXPECT_TRUE(AllBytes() == alone) << preset;
    const auto made = fs::last_write_time(workspace_.DepthPath(0, kFinalMaps));
    EstimateMaps(folder_, Quick(preset), progress_);  // finds everything done
    EXPECT_EQ(fs::last_write_time(workspace_.DepthPath(0, kFinalMaps)), made);
    EXPECT_TRUE(AllBytes() == alone) << preset;
  }
}

TEST_F(Sphere, AShardWithoutTheOthersSaysWhatIsMissing) {
  Write(true);
  try {
    EstimateMaps(folder_, Quick("fast"), progress_, {0, 2, 0.3});
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("Start all shards"), std::string::npos) << e.what();
  }
}

TEST_F(Sphere, AViewWithoutSourcesIsNamed) {
  Write(true);
  workspace_.views[3].sources.clear();
  WriteWorkspace(workspace_);
  try {
    EstimateMaps(folder_, Quick("default"), progress_);
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("v3"), std::string::npos) << e.what();
  }
}

TEST(StereoOptionTable, HasAPresetForEachOfItsNamesAndNoTwoAreAlike) {
  StereoOptions options;
  const OptionTable table = Table(options);
  std::set<std::string> presets;
  for (const std::string& name : table.front().choices) {
    StereoOptions preset = StereoPreset(name);
    EXPECT_EQ(preset.preset, name);
    preset.preset.clear();
    presets.insert(ToJson(Table(preset)).dump());
  }
  EXPECT_EQ(table.front().name, "preset");
  EXPECT_EQ(presets.size(), table.front().choices.size());
}

TEST(StereoOptionTable, TakesItsOwnValuesBackAndRefusesOthers) {
  StereoOptions options = StereoPreset("paper"), other;
  OptionTable table = Table(other);
  FromJson(ToJson(Table(options)), table);
  EXPECT_EQ(ToJson(table), ToJson(Table(options)));
  EXPECT_THROW(FromJson({{"samples", 0}}, table), Error);
  EXPECT_THROW(FromJson({{"polarization-residual", "cubic"}}, table), Error);
  EXPECT_THROW(StereoPreset("fastest"), Error);
}

}  // namespace
}  // namespace polarscan
