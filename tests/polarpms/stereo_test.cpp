// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/stereo.h"

#include <gtest/gtest.h>

#include <set>

#include "stereo/costs/hull_intervals.h"
#include "stereo/dense/load_view.h"
#include "stereo/search/continuous.h"
#include "stereo/search/filter.h"
#include "tests/polarpms/sphere_views.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

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
