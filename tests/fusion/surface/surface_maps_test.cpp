// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/stereo.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <tuple>

#include "core/error.h"
#include "core/random.h"
#include "pipeline/stereo/corrections/aop_check.h"
#include "pipeline/stereo/done_list.h"
#include "stereo/costs/stereo_view.h"
#include "stereo/dense/load_view.h"
#include "tests/fusion/sphere_scene.h"

namespace polarscan {
namespace {

class SurfaceMaps : public testing::Test {
 protected:
  SurfaceMaps() {
    options_.surface_change_px = 1e3;                 // two surfaces
    options_.polarization = options_.filter = false;  // sphere_scene's AoP is none of a sphere
    WriteSphereMasks(workspace_);
  }

  // Separate maps of the unit sphere, as stereo leaves them; change(view, maps) may damage some.
  void Write(const std::function<void(int, SphereMaps&)>& change) {
    WriteSphere(workspace_, change, kSeparateMaps);
    ListSeparateMaps();
  }

  void ListSeparateMaps() const {
    const Workspace chosen = ChosenViews(workspace_, options_.views);
    DoneList done(chosen, StereoInputHash(chosen, options_));
    for (int view = 0; view < int(chosen.views.size()); ++view) done.Add(view, kSeparateMaps);
  }

  static void AddNoise(int view, SphereMaps& maps) {
    Random random(3, std::uint64_t(view));
    for (std::size_t i = 0; i < maps.depth.size(); ++i) {
      if (maps.depth.pixels()[i] <= 0) continue;
      const bool wild = random.Uniform() < 0.05;
      maps.depth.pixels()[i] *= float(1 + (wild ? 0.1 : 0.002) * random.Normal());
      Eigen::Vector3f& normal = maps.normal.pixels()[i];
      for (int k = 0; k < 3; ++k) normal[k] += float(0.1 * random.Normal());
      normal.normalize();
    }
  }

  struct Errors {
    double depth = 0, normal_deg = 0;
    std::size_t pixels = 0;
  };
  // Means over the pixels of all views whose ray meets the sphere by more than a twentieth of its radius.
  Errors Compare(const MapKind& kind) const {
    Errors errors;
    for (int i = 0; i < int(workspace_.views.size()); ++i) {
      const SphereMaps truth = ExactSphereMaps(workspace_.views[std::size_t(i)]);
      const Image<float> depth = ReadDepthMap(workspace_.DepthPath(i, kind));
      const Image<Eigen::Vector3f> normal = ReadNormalMap(workspace_.NormalPath(i, kind));
      for (std::size_t k = 0; k < depth.size(); ++k) {
        if (truth.depth.pixels()[k] <= 0 || depth.pixels()[k] <= 0) continue;
        errors.depth += std::abs(depth.pixels()[k] - truth.depth.pixels()[k]);
        errors.normal_deg +=
            AngleDegrees(normal.pixels()[k].cast<double>(), truth.normal.pixels()[k].cast<double>());
        ++errors.pixels;
      }
    }
    errors.depth /= double(errors.pixels), errors.normal_deg /= double(errors.pixels);
    return errors;
  }

  std::string FinalBytes() const {
    std::string bytes;
    for (int i = 0; i < int(workspace_.views.size()); ++i)
      bytes += ReadFile(workspace_.DepthPath(i, kFinalMaps)) + ReadFile(workspace_.NormalPath(i, kFinalMaps));
    return bytes;
  }

  // Keeps what is said, counts the surfaces that maps are drawn from; cancels after so many maps, drawn or
  // final.
  class Listener : public Progress {
   public:
    explicit Listener(int advances = 1 << 30) : left_(advances) {}
    void Warn(const std::string& message) override { words += message; }
    void Begin(const std::string& title, std::size_t, const std::string&) override {
      surfaces += title == "maps from the surface";
      counting_ = title == "maps from the surface" || title == "final maps";
    }
    void Advance(std::size_t) override {
      if (counting_ && --left_ == 0) Cancel();
    }
    std::string words;
    int surfaces = 0;

   private:
    bool counting_ = false;
    int left_;
  };

  TemporaryFolder folder_;
  Workspace workspace_ = SphereWorkspace(folder_.path(), 18);
  StereoOptions options_;
  Listener listener_;
};

TEST_F(SurfaceMaps, EveryPixelKnowsWhatAllPixelsOfAllViewsKnow) {
  Write(AddNoise);
  const Errors before = Compare(kSeparateMaps);
  EstimateMaps(folder_.path(), options_, listener_);
  const Errors after = Compare(kFinalMaps);
  EXPECT_LT(after.depth, 0.3 * before.depth);
  EXPECT_LT(after.normal_deg, 0.5 * before.normal_deg);
  EXPECT_EQ(after.pixels, before.pixels) << "every pixel keeps an estimate";
  EXPECT_FALSE(std::filesystem::exists(workspace_.DepthPath(0, kSeparateMaps)));
  EXPECT_EQ(listener_.words, "");
}

TEST_F(SurfaceMaps, StoppedInTheMiddleItGoesOnToTheSameBytesWithAnyNumberOfThreads) {
  Write(AddNoise);
  EstimateMaps(folder_.path(), options_, listener_);
  const std::string undisturbed = FinalBytes();
  for (int i = 0; i < 18; ++i) std::filesystem::remove(workspace_.DepthPath(i, kFinalMaps));
  Write(AddNoise);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  Listener impatient(18 + 7), less_so(18 + 7);  // in the second surface's maps; in the final ones
  EXPECT_THROW(EstimateMaps(folder_.path(), options_, impatient), Cancelled);
  EXPECT_FALSE(std::filesystem::exists(workspace_.DepthPath(0, kFinalMaps)));
  EXPECT_THROW(EstimateMaps(folder_.path(), options_, less_so), Cancelled);
  EXPECT_EQ(less_so.surfaces, 1) << "the first one is not made again";
  EXPECT_TRUE(std::filesystem::exists(workspace_.DepthPath(0, kFinalMaps)));
  EXPECT_FALSE(std::filesystem::exists(workspace_.DepthPath(17, kFinalMaps)));
  EstimateMaps(folder_.path(), options_, listener_);
  EXPECT_TRUE(FinalBytes() == undisturbed);
}

TEST_F(SurfaceMaps, TheNextSurfaceIsMadeWhileTheLastOneMovedTheDepthsByAsMuch) {
  options_.surfaces = 4;
  for (const auto& [change, surfaces] : {std::pair{1e3, 2}, std::pair{0.0, 4}}) {
    options_.surface_change_px = change;
    Write(AddNoise);
    Listener listener;
    EstimateMaps(folder_.path(), options_, listener);
    EXPECT_EQ(listener.surfaces, surfaces) << change;
  }
}

TEST_F(SurfaceMaps, PolarizationThatIsNothingButNoiseIsLeftOut) {
  std::string bytes[2];
  for (const bool polarization : {false, true}) {
    WriteSphere(workspace_, AddNoise, kSeparateMaps);
    EXPECT_TRUE(AopIsInformative(workspace_, true));
    Random random(5);
    for (int view = 0; view < 18; ++view) {
      StokesImage stokes = ReadStokes(workspace_.StokesPath(view));
      for (auto* part : {&stokes.s1, &stokes.s2})
        for (float& value : part->pixels()) value = 0.01f * float(random.Normal());  // as `noise` says
      WriteStokes(workspace_.StokesPath(view), stokes);
    }
    EXPECT_FALSE(AopIsInformative(workspace_, true));
    ListSeparateMaps();  // as made without polarization
    options_.polarization = polarization;
    EstimateMaps(folder_.path(), options_, listener_);
    options_.polarization = false;
    bytes[polarization] = FinalBytes();
    EXPECT_EQ(listener_.words.find("nothing but noise") != std::string::npos, polarization);
  }
  EXPECT_TRUE(bytes[0] == bytes[1]);
}

TEST_F(SurfaceMaps, OnlyTheViewsAskedForHaveMaps) {
  Write(AddNoise);
  EstimateMaps(folder_.path(), options_, listener_);
  options_.views = "v10*,v11[0-3]";
  Write(AddNoise);
  EstimateMaps(folder_.path(), options_, listener_);
  for (int view = 0; view < 18; ++view) {
    EXPECT_EQ(std::filesystem::exists(workspace_.DepthPath(view, kFinalMaps)), view < 14) << view;
    EXPECT_EQ(std::filesystem::exists(workspace_.NormalPath(view, kFinalMaps)), view < 14) << view;
  }
}

TEST(ChosenViews, KeepTheirSourcesUnderTheirNewNumbers) {
  TemporaryFolder folder;
  const Workspace all = SphereWorkspace(folder.path(), 6), chosen = ChosenViews(all, "v105,v10[13]");
  ASSERT_EQ(chosen.views.size(), 3u);
  EXPECT_EQ(chosen.views[1].name, "v103");
  EXPECT_EQ(chosen.views[1].sources, (std::vector<int>{0, 2}));
  EXPECT_EQ(ChosenViews(all, "").views.size(), 6u);
  EXPECT_THROW(ChosenViews(all, "v101,v2*"), Error);
  EXPECT_THROW(ChosenViews(all, "v101"), Error);
}

TEST_F(SurfaceMaps, MapsThatMakeNoSurfaceStayAndThatIsSaid) {
  Write([](int view, SphereMaps& maps) {  // no two views agree
    for (float& depth : maps.depth.pixels()) depth *= 1 + 0.05f * float(view);
  });
  const Errors before = Compare(kSeparateMaps);
  EstimateMaps(folder_.path(), options_, listener_);
  EXPECT_EQ(Compare(kFinalMaps).depth, before.depth);
  EXPECT_NE(listener_.words.find("stay separate"), std::string::npos) << listener_.words;
}

TEST_F(SurfaceMaps, PhotographsWithoutMasksKeepTheirSeparateMaps) {
  WriteWorkspace(workspace_);
  for (int view = 0; view < 18; ++view) {
    const Pinhole& camera = workspace_.views[std::size_t(view)].camera;
    WritePng(workspace_.PicturePath(view), Image<std::uint8_t>(camera.width, camera.height, 100));
  }
  options_.masks = false;
  options_.refinements = options_.rounds = 0, options_.levels = 1;
  EstimateMaps(folder_.path(), options_, listener_);
  EXPECT_TRUE(std::filesystem::exists(workspace_.DepthPath(17, kFinalMaps)));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "stereo/surface"));
  const StereoPlan plan = PlanMaps(folder_.path(), options_);
  EXPECT_EQ(plan.steps.back().kind, kFinalMaps);
  EXPECT_EQ(plan.steps.back().done, 18);
  EXPECT_EQ(listener_.words, "");
}

TEST_F(SurfaceMaps, TheFilterDropsWhatHardlyAnyOtherViewSupports) {
  const auto upper_cap = [this](int view, SphereMaps& maps) {  // all views but two miss it
    if (view < 2) return;
    const Rigid& pose = workspace_.views[std::size_t(view)].cam_from_world;
    for (std::size_t i = 0; i < maps.depth.size(); ++i)
      if ((pose.rotation.transpose() * maps.normal.pixels()[i].cast<double>()).y() > 0.5)
        maps.depth.pixels()[i] = 0;
  };
  const auto kept_of_cap = [this] {
    const SphereMaps truth = ExactSphereMaps(workspace_.views[1]);
    const Image<float> depth = ReadDepthMap(workspace_.DepthPath(1, kFinalMaps));
    double kept = 0, all = 0;
    for (std::size_t i = 0; i < depth.size(); ++i)
      if (truth.depth.pixels()[i] > 0 &&
          (workspace_.views[1].cam_from_world.rotation.transpose() * truth.normal.pixels()[i].cast<double>())
                  .y() > 0.6)
        ++all, kept += depth.pixels()[i] > 0;
    return kept / all;
  };
  Write(upper_cap);
  EstimateMaps(folder_.path(), options_, listener_);
  EXPECT_EQ(kept_of_cap(), 1);
  options_.filter = true, options_.filter_min_variance = 0;
  Write(upper_cap);
  EstimateMaps(folder_.path(), options_, listener_);
  EXPECT_LT(kept_of_cap(), 0.1);
}

TEST_F(SurfaceMaps, OfTwoViewsTheFilterAsksForNoMoreThanTheirOwnAgreement) {
  const StereoOptions usual;
  options_.filter = true, options_.filter_min_variance = 0, options_.views = "v100,v101";
  options_.filter_min_support = 1.2;  // so these maps are those of two views
  Write([](int, SphereMaps&) {});
  options_.filter_min_support = usual.filter_min_support;
  EstimateMaps(folder_.path(), options_, listener_);
  const Image<float> depth = ReadDepthMap(workspace_.DepthPath(0, kFinalMaps)),
                     truth = ExactSphereMaps(workspace_.views[0]).depth;
  const auto count = [](const Image<float>& map) {
    return std::ranges::count_if(map.pixels(), [](float d) { return d > 0; });
  };
  EXPECT_GT(double(count(depth)), 0.4 * double(count(truth)));
  EXPECT_LT(count(depth), count(truth)) << "what one view sees stays out";
}

// The maps are exact; the AoP, of the first views only if `turned` says how many, are turned
// (s1, s2) -> turn(s1, s2).
AopFits FitsOfAngles(const std::function<std::pair<float, float>(float, float)>& turn, float noise = 0,
                     int turned = 1000) {
  TemporaryFolder folder;
  const Workspace workspace = LitSphere(folder.path(), 12, 120, 90);
  Random random(9);
  for (int view = 0; view < int(workspace.views.size()); ++view) {
    const SphereMaps maps = ExactSphereMaps(workspace.views[std::size_t(view)]);
    WriteDepthMap(workspace.DepthPath(view, kFinalMaps), maps.depth);
    WriteNormalMap(workspace.NormalPath(view, kFinalMaps), maps.normal);
    StokesImage stokes = ReadStokes(workspace.StokesPath(view));
    for (std::size_t i = 0; i < stokes.s1.size(); ++i) {
      float &s1 = stokes.s1.pixels()[i], &s2 = stokes.s2.pixels()[i];
      if (view < turned) std::tie(s1, s2) = turn(s1, s2);
      if (noise > 0) s1 = noise * float(random.Normal()), s2 = noise * float(random.Normal());
    }
    WriteStokes(workspace.StokesPath(view), stokes);
  }
  Progress progress;
  return CheckAop(workspace, StereoOptions(), progress);
}
AopFit FitOfAngles(const std::function<std::pair<float, float>(float, float)>& turn, float noise = 0) {
  return FitsOfAngles(turn, noise).all;
}

TEST(AopCheck, ViewsThatAreCountedOtherwiseThanTheRestAreNamed) {
  const auto odd = [](const AopFits& fits) {
    std::vector<std::pair<std::string, AopCount>> names;
    for (const auto& [name, fit] : fits.odd) names.emplace_back(name, fit.other);
    return names;
  };
  using Odd = std::vector<std::pair<std::string, AopCount>>;
  // A mosaic that was cut at an odd pixel: 45 degrees become 90, 90 become 45.
  EXPECT_EQ(odd(FitsOfAngles([](float s1, float s2) { return std::pair(-s2, -s1); }, 0, 1)),
            (Odd{{"v100", AopCount::kMirroredAndShifted}}));
  EXPECT_EQ(odd(FitsOfAngles([](float s1, float s2) { return std::pair(s1, -s2); }, 0, 2)),
            (Odd{{"v100", AopCount::kMirrored}, {"v101", AopCount::kMirrored}}));
  for (const float noise : {0.f, 0.0057f})
    EXPECT_EQ(odd(FitsOfAngles([](float s1, float s2) { return std::pair(s1, s2); }, noise)), Odd{}) << noise;
  EXPECT_EQ(odd(FitsOfAngles([](float s1, float s2) { return std::pair(-s1, -s2); }, 0, 1)), Odd{})
      << "a quarter-turn does no harm";
}

TEST(AopCheck, AnglesThatAreCountedAnotherWayAreFoundOut) {
  const AopFit mirrored = FitOfAngles([](float s1, float s2) { return std::pair(s1, -s2); });
  EXPECT_TRUE(mirrored.IsWrong());
  EXPECT_EQ(mirrored.other, AopCount::kMirrored);
  const AopFit shifted = FitOfAngles([](float s1, float s2) { return std::pair(-s2, s1); });
  EXPECT_TRUE(shifted.IsWrong());
  EXPECT_EQ(shifted.other, AopCount::kShifted);
  const AopFit both = FitOfAngles([](float s1, float s2) { return std::pair(s2, s1); });
  EXPECT_TRUE(both.IsWrong());
  EXPECT_EQ(both.other, AopCount::kMirroredAndShifted);
}

TEST(AopCheck, RightAnglesQuarterTurnsAndNoiseAreNotBlamed) {
  const AopFit right = FitOfAngles([](float s1, float s2) { return std::pair(s1, s2); });
  EXPECT_FALSE(right.IsWrong());
  EXPECT_GT(right.points, 500);
  EXPECT_LT(right.sigmas, -4) << "it does not only fail to tell";
  EXPECT_FALSE(FitOfAngles([](float s1, float s2) { return std::pair(-s1, -s2); }).IsWrong());
  int turns = 0;  // every second pixel's light is specular
  const AopFit mixed =
      FitOfAngles([&](float s1, float s2) { return turns++ % 2 ? std::pair(s1, s2) : std::pair(-s1, -s2); });
  EXPECT_FALSE(mixed.IsWrong());
  EXPECT_FALSE(FitOfAngles([](float s1, float s2) { return std::pair(s1, s2); }, 0.0057f).IsWrong());
  EXPECT_FALSE(FitOfAngles([](float, float) { return std::pair(0.f, 0.f); }).IsWrong());
}

}  // namespace
}  // namespace polarscan
