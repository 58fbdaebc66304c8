// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/inverse_rendering/inverse_rendering.h"

#include <ceres/cost_function.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <numbers>

#include "core/random.h"
#include "fusion/surface/inverse_rendering/smoothness.h"
#include "fusion/surface/inverse_rendering/vertex_cost.h"
#include "pipeline/workspace_views.h"
#include "tests/fusion/icosphere.h"
#include "tests/fusion/sphere_scene.h"

namespace polarscan {
namespace {

Eigen::Vector3d RandomDirection(Random& random) {
  return Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized();
}

// Light that differs a little from view to view, positive wherever a normal points.
Harmonics SkyLight(int view) {
  Harmonics light;
  light << 1, 0.25, 0.15, 0.2 * std::cos(view), 0.05, -0.05, 0.1, 0.05 * std::sin(view), -0.1;
  return light;
}

// The albedo of the lit sphere: one of two by its place in a pattern of patches.
double SphereAlbedo(const Eigen::Vector3d& n) {
  return std::sin(4 * n.x()) * std::cos(5 * n.z()) > 0.2 ? 0.7 : 1.1;
}

// The AoP that a normal reflects, diffuse or specular, seen along the z axis; weight 1.
AopConstraint AopAt(double azimuth) {
  return MakeAopConstraint({float(std::cos(azimuth)), float(std::sin(azimuth)), 1, 1}, 0, 0);
}

// 18 views (SphereWorkspace) of the unit sphere under SkyLight, pixels 0.02 wide, without noise: S0 by albedo
// and light, AoP diffuse, DoP rising with the tilt; masks.
Workspace ShadedSphere(const std::filesystem::path& folder) {
  Workspace workspace = SphereWorkspace(folder, 18);
  WriteWorkspace(workspace);
  WriteSphereMasks(workspace);
  for (int i = 0; i < int(workspace.views.size()); ++i) {
    const DenseView& view = workspace.views[std::size_t(i)];
    const SphereMaps maps = ExactSphereMaps(view);
    const int width = maps.depth.width(), height = maps.depth.height();
    StokesImage stokes{{width, height}, {width, height}, {width, height}, {width, height, 0.001f}};
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        if (maps.depth(x, y) <= 0) continue;
        const Eigen::Vector3d n = maps.normal(x, y).cast<double>(), ray = view.camera.Ray(x + 0.5, y + 0.5);
        const Eigen::Vector3d at = view.cam_from_world.rotation.transpose() * n;
        const double s0 = 0.3 * SphereAlbedo(at) * SkyLight(i).dot(HarmonicsAt(at));
        const double azimuth = std::atan2(-(n.y() - n.z() * ray.y()), n.x() - n.z() * ray.x());
        const double dop = 0.3 * (1 - std::pow(n.dot(ray.normalized()), 2));
        stokes.s0(x, y) = float(s0);
        stokes.s1(x, y) = float(s0 * dop * std::cos(2 * azimuth));
        stokes.s2(x, y) = float(s0 * dop * std::sin(2 * azimuth));
      }
    WriteStokes(workspace.StokesPath(i), stokes);
  }
  return workspace;
}

// Every vertex moved along its normal by noise of this standard deviation.
TriangleMesh NoisySphere(int divisions, double noise) {
  TriangleMesh mesh = Icosphere(divisions);
  Random random(3, 1);
  for (Eigen::Vector3d& v : mesh.vertices) v *= 1 + noise * random.Normal();
  ComputeVertexNormals(mesh);
  return mesh;
}

struct SphereErrors {
  double distance = 0, normal_deg = 0;  // root mean square, mean; over what many cameras see
};

SphereErrors OffSphere(const TriangleMesh& mesh) {
  SphereErrors errors;
  double count = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (std::abs(mesh.vertices[i].y()) > 0.6) continue;
    errors.distance += std::pow(mesh.vertices[i].norm() - 1, 2);
    errors.normal_deg += AngleDegrees(mesh.normals[i], mesh.vertices[i]);
    ++count;
  }
  return {std::sqrt(errors.distance / count), errors.normal_deg / count};
}

RenderedSurface RenderSphere(const TriangleMesh& mesh, const Workspace& workspace,
                             const MvirOptions& options = {}, bool polarized = true) {
  Progress progress;
  MvirCounts counts;
  return RenderInversely(mesh, ViewsOfWorkspace(workspace), polarized, options, counts, progress);
}

// Samples of every vertex in three views, and lights: any numbers.
struct AnyObservations {
  VertexSamples samples;
  std::vector<Harmonics> lights{SkyLight(0), SkyLight(1), SkyLight(2)};
};

AnyObservations Observations(std::size_t vertices) {
  Random random(5, 1);
  std::vector<std::vector<VertexSamples::Seen>> seen(3);
  for (int view = 0; view < 3; ++view)
    for (std::uint32_t v = 0; v < vertices; ++v) {
      const auto phi = float(3 * random.Uniform());
      AopConstraint aop =
          MakeAopConstraint({std::cos(phi), std::sin(phi), 0.4f, 0.4f}, float(0.2 * view), 0.1f);
      seen[std::size_t(view)].emplace_back(v, VertexSample{view, float(0.5 + random.Uniform()), aop});
    }
  return {VertexSamples(vertices, seen)};
}

// Each derivative against the difference quotient of both sides.
void ExpectDerivatives(const ceres::CostFunction& cost, std::vector<double> x) {
  const auto rows = std::size_t(cost.num_residuals());
  std::vector<std::vector<double>> columns(x.size(), std::vector<double>(rows));
  std::vector<double*> jacobians;
  std::vector<const double*> parameters;
  for (std::vector<double>& column : columns) jacobians.push_back(column.data());
  for (const double& value : x) parameters.push_back(&value);
  std::vector<double> at(rows), above(rows), below(rows);
  ASSERT_TRUE(cost.Evaluate(parameters.data(), at.data(), jacobians.data()));
  constexpr double kStep = 1e-6;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double middle = x[k];
    x[k] = middle + kStep, cost.Evaluate(parameters.data(), above.data(), nullptr);
    x[k] = middle - kStep, cost.Evaluate(parameters.data(), below.data(), nullptr);
    x[k] = middle;
    for (std::size_t row = 0; row < rows; ++row)
      EXPECT_NEAR(columns[k][row], (above[row] - below[row]) / (2 * kStep), 1e-6) << k << ' ' << row;
  }
}

TEST(InverseRendering, TheAzimuthsResidualIsZeroAtAllFourAnglesAndOneInBetween) {
  const double u = (std::exp(-0.25) - std::exp(-0.5)) / (1 - std::exp(-0.5));  // theta = 1/2
  for (int quarter = 0; quarter < 4; ++quarter) {
    const double aop = 0.3;
    const auto at = [&](double degrees) {
      const double azimuth = aop + quarter * std::numbers::pi / 2 + degrees * std::numbers::pi / 180;
      // image axes: y down
      return ConcaveAzimuth(AopAt(aop), {std::cos(azimuth), -std::sin(azimuth), -0.5}).value;
    };
    EXPECT_NEAR(at(0), 0, 1e-6);
    EXPECT_NEAR(at(22.5), u, 1e-6);
    EXPECT_NEAR(at(-22.5), -u, 1e-6);
    EXPECT_NEAR(std::abs(at(45)), 1, 1e-5);
  }
}

TEST(InverseRendering, DerivativesOfAVertexAreThoseOfItsDifferences) {
  const TriangleMesh mesh = NoisySphere(2, 0.03);
  const VertexNeighbours neighbours(mesh.vertices.size(), mesh.triangles);
  const AnyObservations any = Observations(mesh.vertices.size());
  const MovingSurface surface{mesh, neighbours, 0.2};
  const Observed observed{any.samples, any.lights, 0.7, 1.3};
  Random random(9, 1);
  for (const std::uint32_t vertex : {0u, 7u, 40u}) {
    std::vector<double> x;
    for (std::size_t k = 0; k <= neighbours.Of(vertex).size(); ++k) x.push_back(0.2 * random.Normal());
    x.push_back(0.8);  // albedo
    ExpectDerivatives(*MakeVertexCost(surface, observed, vertex), x);
  }
}

TEST(InverseRendering, DerivativesOfSmoothnessAreThoseOfItsDifferences) {
  const TriangleMesh mesh = NoisySphere(2, 0.03);
  const VertexNeighbours neighbours(mesh.vertices.size(), mesh.triangles);
  const MovingSurface surface{mesh, neighbours, 0.2};
  const FacetStars stars = MakeFacetStars(mesh.triangles);
  Random random(9, 2);
  for (const std::size_t facet : {0u, 9u, 60u}) {
    ASSERT_TRUE(stars[facet]);
    const FacetCost cost = MakeFacetCost(surface, *stars[facet], 2);
    EXPECT_EQ(cost.vertices.size(), 6u);
    std::vector<double> x;
    for (std::size_t k = 0; k < cost.vertices.size(); ++k) x.push_back(0.1 * random.Normal());
    ExpectDerivatives(*cost.cost, x);
  }
  ExpectDerivatives(*MakeAlbedoCost(3), {0.7, 1.1});
  ExpectDerivatives(*MakeAnchorCost(3, -0.2), {0.7});
}

// A triangle with three neighbours in its plane, one of them bent up by an angle: the mean of the neighbours'
// normals is off by atan2(sin, 2 + cos) of that.
TEST(InverseRendering, AFoldCostsItsAngleToThePowerOf22) {
  const double bend = 0.6, off = std::atan2(std::sin(bend), 2 + std::cos(bend));
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {-1, 1, 0}, {0, 0, 0}};
  mesh.vertices[5] = {0.5, -std::cos(bend), std::sin(bend)};
  mesh.triangles = {{0, 1, 2}, {1, 3, 2}, {0, 2, 4}, {1, 0, 5}};
  mesh.normals.assign(6, Eigen::Vector3d::UnitZ());
  const FacetStars stars = MakeFacetStars(mesh.triangles);
  EXPECT_FALSE(stars[1]) << "at the border";
  ASSERT_TRUE(stars[0]);
  const VertexNeighbours neighbours(6, mesh.triangles);
  const std::vector<double> zeros(6, 0);
  std::vector<const double*> x;
  for (const double& zero : zeros) x.push_back(&zero);
  Eigen::Vector3d residuals;
  MakeFacetCost({mesh, neighbours, 1}, *stars[0], 2).cost->Evaluate(x.data(), residuals.data(), nullptr);
  EXPECT_NEAR(residuals.squaredNorm(), 2 * std::pow(off / std::numbers::pi, 2.2), 1e-9);
}

TEST(InverseRendering, LightsAreFoundFromNormalsAndAlbedos) {
  Random random(7, 1);
  std::vector<Eigen::Vector3d> normals;
  std::vector<double> albedo;
  std::vector<std::vector<VertexSamples::Seen>> seen(2);
  for (std::uint32_t v = 0; v < 400; ++v) {
    normals.push_back(RandomDirection(random));
    albedo.push_back(0.5 + random.Uniform());
    for (int view = 0; view < 2; ++view)
      if (view == 0 || v % 3 == 0)
        seen[std::size_t(view)].emplace_back(
            v, VertexSample{view, float(albedo[v] * SkyLight(view).dot(HarmonicsAt(normals[v]))),
                            VertexSample().aop});
  }
  const auto lights = FitLights(normals, albedo, VertexSamples(normals.size(), seen), 3);
  for (int view = 0; view < 2; ++view)
    EXPECT_LT((lights[std::size_t(view)] - SkyLight(view)).norm(), 1e-4) << lights[std::size_t(view)];
  EXPECT_EQ(lights[2].norm(), 0) << "a view that sees nothing";
}

// How far the shading of each view is off the truth, as a share of it, over normals that the view sees; up to
// one factor for all, which the albedos hold.
double OffLights(const std::vector<Harmonics>& lights, const Workspace& workspace) {
  std::vector<std::pair<double, double>> shadings;  // found, true
  double products = 0, squares = 0, off = 0, truth = 0;
  for (std::size_t i = 0; i < lights.size(); ++i)
    for (const Eigen::Vector3d& n : Icosphere(3).vertices)
      if (n.dot(workspace.views[i].cam_from_world.Center().normalized()) > 0.4)
        shadings.emplace_back(lights[i].dot(HarmonicsAt(n)), SkyLight(int(i)).dot(HarmonicsAt(n)));
  for (const auto& [a, b] : shadings) products += a * b, squares += a * a;
  for (const auto& [a, b] : shadings) off += std::pow(a * products / squares - b, 2), truth += b * b;
  return std::sqrt(off / truth);
}

TEST(InverseRendering, ANoisySphereBecomesTheSphereAgain) {
  TemporaryFolder folder;
  const Workspace workspace = ShadedSphere(folder.path());
  const TriangleMesh noisy = NoisySphere(4, 0.01);
  const SphereErrors before = OffSphere(noisy);
  const RenderedSurface rendered = RenderSphere(noisy, workspace);
  const SphereErrors after = OffSphere(rendered.mesh);
  EXPECT_LT(after.distance, 0.2 * before.distance) << before.distance;
  EXPECT_LT(after.normal_deg, 0.15 * before.normal_deg) << before.normal_deg;
  EXPECT_LT(OffLights(rendered.lights, workspace), 0.08);
}

TEST(InverseRendering, SmoothnessAloneIsWorseThanWithTheAop) {
  TemporaryFolder folder;
  const Workspace workspace = ShadedSphere(folder.path());
  const TriangleMesh noisy = NoisySphere(4, 0.01);
  MvirOptions smooth;
  smooth.photometric = smooth.polarimetric = 0;
  MvirOptions azimuth = smooth;
  azimuth.polarimetric = MvirOptions().polarimetric;
  const SphereErrors alone = OffSphere(RenderSphere(noisy, workspace, smooth).mesh);
  const SphereErrors both = OffSphere(RenderSphere(noisy, workspace, azimuth).mesh);
  EXPECT_LT(alone.normal_deg, OffSphere(noisy).normal_deg);
  EXPECT_LT(both.normal_deg, 0.7 * alone.normal_deg);
  EXPECT_LT(both.distance, 0.7 * alone.distance);
}

TEST(InverseRendering, OneAndTwoThreadsGiveTheSameMesh) {
  TemporaryFolder folder;
  const Workspace workspace = ShadedSphere(folder.path());
  const TriangleMesh noisy = NoisySphere(3, 0.01);
  MvirOptions options;
  options.rounds = 2;
  std::vector<RenderedSurface> results;
  for (std::size_t threads : {1, 2}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(RenderSphere(noisy, workspace, options));
  }
  EXPECT_TRUE(results[0].mesh.vertices == results[1].mesh.vertices);
  EXPECT_TRUE(results[0].albedo == results[1].albedo);
  EXPECT_FALSE(results[0].mesh.vertices == noisy.vertices);
}

TEST(InverseRendering, StopsWhenItIsCancelledAndRefusesAMeshThatNoViewSees) {
  TemporaryFolder folder;
  const Workspace workspace = ShadedSphere(folder.path());
  TriangleMesh mesh = Icosphere(2);
  Progress progress;
  MvirCounts counts;
  progress.Cancel();
  EXPECT_THROW(RenderInversely(mesh, ViewsOfWorkspace(workspace), true, {}, counts, progress), Cancelled);
  for (Eigen::Vector3d& v : mesh.vertices) v.y() += 50;
  EXPECT_THROW(RenderSphere(mesh, workspace), Error);
}

}  // namespace
}  // namespace polarscan
