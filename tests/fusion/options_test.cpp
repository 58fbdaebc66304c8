// SPDX-License-Identifier: Apache-2.0
// Every option of stereo, fusion and mesh changes a result. One that is in no table here fails the test: say
// which value changes something, on top of which others, or why none can.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "core/random.h"
#include "fusion/cloud/cloud.h"
#include "fusion/cloud/fuse.h"
#include "pipeline/meshing.h"
#include "pipeline/stereo/stereo.h"
#include "tests/fusion/icosphere.h"
#include "tests/fusion/sphere_scene.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// An option with a value that must change the result which `others` give.
struct Trial {
  std::string name;
  json value;
  json others = json::object();
};

// Fails for each option of the table that is neither tried nor excused, and for each that changes nothing.
// result: bytes that come of {name: value}.
template <class Result>
void ExpectEachToMatter(const OptionTable& table, const std::vector<Trial>& trials,
                        const std::map<std::string, std::string>& excused, Result&& result) {
  std::map<std::string, std::string> before;  // by the others
  std::set<std::string> tried;
  for (const Trial& trial : trials) {
    json given = trial.others;
    const std::string key = given.dump();
    if (!before.contains(key)) before[key] = result(given);
    given[trial.name] = trial.value;
    EXPECT_TRUE(result(given) != before[key])
        << "--" << trial.name << " " << trial.value << " changes nothing";
    tried.insert(trial.name);
  }
  for (const Option& row : table)
    EXPECT_TRUE(tried.contains(row.name) || excused.contains(row.name))
        << "--" << row.name << " is not tried";
}

TEST(EachOption, OfStereoChangesMaps) {
  const json paper = {{"preset", "paper"}}, separate = {{"surfaces", 0}},
             large = {{"large", true}, {"surfaces", 0}, {"photometric-iterations", 1}, {"rounds", 1}};
  const std::vector<Trial> trials = {
      {"polarization", false},
      {"depth-normal", false, separate},
      {"masks", false},
      {"filter", false},
      {"seed", 2},
      {"views", "v10[0-3]"},
      {"schedule", "sequential"},
      {"levels", 1, large},
      {"search-levels", 2, large},
      {"refinements", 1, large},
      {"surfaces", 1},
      {"surface-change", 1000, {{"surfaces", 3}, {"surface-change", 0}}},
      {"rounds", 1},
      {"chosen-sources", 1},
      {"photometric-iterations", 1},
      {"geometric-iterations", 2, {{"preset", "paper"}, {"geometric-iterations", 1}}},
      {"warm-geometric-pass", true, paper},
      {"paired-sweeps", false, paper},
      {"continuous-iterations", 5, paper},
      {"random-hypotheses", false, paper},
      {"sources", 2},
      {"samples", 3, paper},
      {"window-radius", 3},
      {"window-step", 1},
      {"window-corners", true},
      {"sigma-color", 0.05},
      {"ncc-sigma", 0.2, paper},
      {"ncc-epsilon", 0.01},
      {"reference-min-variance", 0.01},
      {"source-min-variance", 0.01},
      {"incident-angle-sigma", 0.3, paper},
      {"min-triangulation-angle", 30, paper},
      {"geometric-weight", 2, paper},
      {"geometric-max", 1, paper},
      {"polarization-weight", 3},
      {"depth-normal-weight", 2, paper},
      {"polarization-evidence", "dop"},
      {"dop-saturation", 0.2, {{"polarization-evidence", "dop"}}},
      {"aop-noise", 2},
      {"polarization-residual", "exponential"},
      {"residual-steepness", 5, paper},
      {"residual-power", 1, paper},
      {"count-unseen", false, paper},
      {"closed-form-normals", false},
      {"silhouettes", false},
      {"silhouette-margin", 8},
      {"depth-perturbation", 0.5},
      {"vote-sigma", 0.02},
      {"vote-support", 0.9, separate},
      {"vote-trust", 5, {{"masks", false}, {"surfaces", 0}}},
      {"vote-angle", 25},
      {"vote-views", 2},
      {"matching-sources", 1, large},
      {"matching-window", 3, large},
      {"matching-smoothing", 1, large},
      {"round-iterations", 1},
      {"integration-weight", 1, separate},
      {"filter-min-dop", 0.5},
      {"filter-min-variance", 1000},
      {"filter-min-ncc", 0.9, paper},
      {"filter-min-triangulation-angle", 50, paper},
      {"filter-min-consistent", 5, paper},
      {"filter-max-reprojection", 0.05, paper},
      {"filter-min-support", 4},
  };
  TemporaryFolder small_folder, large_folder;
  const Workspace small = LitSphere(small_folder.path(), 6, 48, 36);
  const Workspace big = LitSphere(large_folder.path(), 3, 264, 198);  // enough for two sizes of pictures
  const auto maps = [&](json given) {
    const Workspace& workspace = given.contains("large") ? big : small;
    given.erase("large");
    StereoOptions options = StereoPreset(given.value("preset", "default"));
    OptionTable table = Table(options);
    FromJson(given, table);
    fs::remove_all(workspace.folder / "stereo");
    Progress progress;
    EstimateMaps(workspace.folder, options, progress);
    std::string bytes;
    for (int view = 0; view < int(workspace.views.size()); ++view)
      if (fs::exists(workspace.DepthPath(view, kFinalMaps)))
        bytes += ReadFile(workspace.DepthPath(view, kFinalMaps)) +
                 ReadFile(workspace.NormalPath(view, kFinalMaps)) + "\n";
    return bytes;
  };
  StereoOptions options;
  ExpectEachToMatter(
      Table(options), trials,
      {{"preset", "it stands for others, which the program sets"},
       {"refine-poses", "it changes sets whose poses are off (fusion.PoseFits..., RefinedPoses...)"},
       {"hull-support", "it changes sets of few views (fusion.HullSupport...)"},
       {"fit-polarization", "it changes sets that are wrong (polarpms.Sphere.Polarization...)"},
       {"cache", "memory: the same bytes with any"}},
      maps);
}

TEST(EachOption, OfFusionChangesTheCloud) {
  const std::vector<Trial> trials = {
      {"fusion-maps", "photometric"},
      {"fusion-min-views", 5},
      {"fusion-reprojection", 0.1},
      {"fusion-depth", 0.0005},
      {"fusion-normal", 1},
      {"fusion-check-views", 3},
      {"fusion-contradictions", 0, {{"fusion-min-views", 1}}},
      {"masks", false},
  };
  TemporaryFolder folder;
  const Workspace workspace = LitSphere(folder.path(), 9, 80, 60);
  for (const MapKind& kind : kResults)
    for (int view = 0; view < int(workspace.views.size()); ++view) {
      SphereMaps maps = ExactSphereMaps(workspace.views[std::size_t(view)]);
      Random random(9, std::uint64_t(view), kind == kFinalMaps);
      for (std::size_t i = 0; i < maps.depth.size(); ++i) {
        float& depth = maps.depth.pixels()[i];
        if (depth <= 0) depth = 5, maps.normal.pixels()[i] = {0, 0, -1};  // outside of the masks
        depth *= float(1 + 0.001 * random.Normal()) * (random.Uniform() < 0.05 ? 0.9f : 1);
        for (int k = 0; k < 3; ++k) maps.normal.pixels()[i][k] += float(0.05 * random.Normal());
        maps.normal.pixels()[i].normalize();
      }
      WriteDepthMap(workspace.DepthPath(view, kind), maps.depth);
      WriteNormalMap(workspace.NormalPath(view, kind), maps.normal);
    }
  FusionOptions options;
  ExpectEachToMatter(Table(options), trials, {{"fusion-memory", "memory: the same bytes with any"}},
                     [&](const json& given) {
                       FusionOptions chosen;
                       OptionTable table = Table(chosen);
                       FromJson(given, table);
                       Progress progress;
                       FuseCloud(folder.path(), folder.path() / "cloud.ply", chosen, progress);
                       return ReadFile(folder.path() / "cloud.ply");
                     });
}

// The part of a ball that the cameras see, with dents, and a little ball beside it.
std::vector<CloudPoint> TwoBalls() {
  std::vector<CloudPoint> cloud;
  Random random(5);
  const auto add = [&](const Eigen::Vector3d& centre, double radius, const Eigen::Vector3d& n) {
    CloudPoint point;
    point.position = (centre + radius * n).cast<float>(), point.normal = n.cast<float>();
    point.confidence = n.y() > 0 ? 0.9f : 0.6f, point.views = 3;
    cloud.push_back(point);
  };
  for (int i = 0; i < 6000; ++i) {
    const Eigen::Vector3d n = Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized();
    if (n.z() > -0.5 && (n - Eigen::Vector3d::UnitX()).norm() > 0.3)  // open behind, and a hole
      add(Eigen::Vector3d::Zero(), 1 + 0.02 * std::sin(9 * n.x()), n);
    if (i % 12 == 0) add({0, 1.6, 0}, 0.25, n);
  }
  return cloud;
}

TEST(EachOption, OfTheMeshAndItsRefinementChangesTheMesh) {
  TemporaryFolder folder;
  const fs::path start = folder.path() / "start.ply";
  WriteMesh(start, Icosphere(3));
  const json cloud = {{"hull-support", false}}, plain = {{"refine", false}},
             mvir = {
                 {"refine-method", "mvir"}, {"mvir-rounds", 1}, {"mvir-steps", 1}, {"hull-support", false}};
  const std::vector<Trial> trials = {
      {"mesh-from", start.string(), plain},
      {"mesh-depth", 7, plain},
      {"mesh-min-confidence", 0.7, plain},
      {"mesh-trim", 3, plain},
      {"mesh-fill-holes", 0, plain},
      {"mesh-min-piece", 0.5, {{"refine", false}, {"masks", false}}},
      {"mesh-edge", 0, cloud},
      {"hull-support", false},
      {"silhouette-margin", 30, plain},
      {"faces", 500, plain},
      {"refine", false},
      {"refine-iterations", 2},
      {"refine-anchor", 1},
      {"refine-smoothness", 5},
      {"refine-outline", 0},
      {"refine-photometric", 0},
      {"refine-method", "mvir"},
      {"mvir-rounds", 2, mvir},
      {"mvir-steps", 5, mvir},
      {"mvir-photometric", 2, mvir},
      {"mvir-polarimetric", 0, mvir},
      {"mvir-smoothness", 0, mvir},
      {"mvir-albedo-smoothness", 0, mvir},
      {"mvir-anchor", 1, mvir},
      {"mvir-dop-saturation", 0.01, mvir},
      {"aop-noise", 1},
      {"polarization", false},
      {"masks", false},
  };
  LitSphere(folder.path(), 9, 80, 60);
  WriteCloud(folder.path() / "cloud.ply", TwoBalls());
  MeshOptions options;
  ExpectEachToMatter(Table(options), trials, {}, [&](const json& given) {
    MeshOptions chosen;
    OptionTable table = Table(chosen);
    FromJson(given, table);
    Progress progress;
    MakeMesh(folder.path() / "cloud.ply", folder.path(), folder.path() / "mesh.ply", chosen, progress);
    return ReadFile(folder.path() / "mesh.ply");
  });
}

}  // namespace
}  // namespace polarscan
