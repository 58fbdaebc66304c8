// SPDX-License-Identifier: Apache-2.0
// Polarized light of the simulator, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "azimuth.h"
#include "simulation/renderer/lit_scene.h"
#include "simulation/renderer/optics.h"
#include "simulation/renderer/render.h"
#include "simulation/scene/shapes.h"

namespace polarscan {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// ---- Fresnel and Stokes, against textbook closed forms

// Diffuse degree of polarization (Atkinson and Hancock 2006, eq. 3).
double DiffuseDop(double theta, double n) {
  const double s = std::pow(std::sin(theta), 2), c = std::cos(theta);
  const double a = std::pow(n - 1 / n, 2) * s;
  return a / (2 + 2 * n * n - std::pow(n + 1 / n, 2) * s + 4 * c * std::sqrt(n * n - s));
}

// Specular degree of polarization (the same paper, eq. 5).
double SpecularDop(double theta, double n) {
  const double s = std::pow(std::sin(theta), 2), c = std::cos(theta), root = std::sqrt(n * n - s);
  return 2 * s * c * root / (n * n - s - n * n * s + 2 * s * s);
}

double Dop(const Vector3d& stokes) { return std::hypot(stokes[1], stokes[2]) / stokes[0]; }

TEST(SimulatorOptics, DiffuseLightIsPolarizedAsAtkinsonAndHancockSay) {
  for (double n : {1.3, 1.5, 1.8})
    for (double theta = 0; theta < 1.57; theta += 0.05)
      EXPECT_NEAR(Dop(DiffuseStokes(1, std::cos(theta), n, {1, 0})), DiffuseDop(theta, n), 1e-9)
          << n << " " << theta;
  EXPECT_NEAR(Dop(DiffuseStokes(1, 1e-6, 1.5, {1, 0})), 0.385, 0.001);  // grazing, the largest
}

TEST(SimulatorOptics, MirroredLightIsPolarizedAsAtkinsonAndHancockSay) {
  for (double n : {1.3, 1.5, 1.8})
    for (double theta = 0.01; theta < 1.56; theta += 0.05)
      EXPECT_NEAR(Dop(SpecularStokes(1, std::cos(theta), n, {1, 0})), SpecularDop(theta, n), 1e-9)
          << n << " " << theta;
  const double brewster = std::atan(1.5);
  EXPECT_NEAR(Dop(SpecularStokes(1, std::cos(brewster), 1.5, {1, 0})), 1, 1e-12);
  EXPECT_NEAR(Fresnel(1, 1.5).s, 0.04, 1e-12);
}

TEST(SimulatorOptics, DiffuseIsPolarizedAlongAndSpecularAcrossTheAzimuth) {
  const double azimuth = 0.7;
  const Vector2d twice(std::cos(2 * azimuth), std::sin(2 * azimuth));
  const Vector3d d = DiffuseStokes(1, 0.4, 1.5, twice), s = SpecularStokes(1, 0.4, 1.5, twice);
  EXPECT_NEAR(std::atan2(d[2], d[1]) / 2, azimuth, 1e-12);
  EXPECT_NEAR(std::remainder(std::atan2(s[2], s[1]) / 2 - azimuth - kPi / 2, kPi), 0, 1e-12);
}

TEST(SimulatorOptics, AnglesAreCountedAnticlockwiseAsDisplayed) {
  const PolarFrame center(0, 0);  // in the picture: right is +x, up is -y
  EXPECT_NEAR((center.DoubleAngle({1, 0, -1}) - Vector2d(1, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((center.DoubleAngle({0, -1, -1}) - Vector2d(-1, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((center.DoubleAngle({1, -1, -1}) - Vector2d(0, 1)).norm(), 0, 1e-12);  // up right: 45 degrees
  EXPECT_NEAR((PolarFrame(0.3, 0.1).DoubleAngle({0, -1, -5}) - center.DoubleAngle({1.5, -0.5, 0})).norm(), 0,
              1e-12);
}

TEST(SimulatorOptics, FacetsOfAMirrorAreItsNormalAndMirrorImagesLieOnBothSides) {
  const Vector3d n = Vector3d(1, 2, 3).normalized(), v = Vector3d(0.5, 0, 1).normalized();
  EXPECT_LT((VisibleFacet(n, v, 0, DiscPoint(0.3, 0.4, 1)) - n).norm(), 1e-6);
  const Vector3d a = VisibleFacet(n, v, 0.3, DiscPoint(0.3, 0.4, 1)),
                 b = VisibleFacet(n, v, 0.3, DiscPoint(0.3, 0.4, -1));
  const Vector3d across = n.cross(v).normalized();
  EXPECT_LT((a - b - 2 * a.dot(across) * across).norm(), 1e-12);
  EXPECT_GT((a - b).norm(), 0.01);
}

// ---- rendered spheres, against the formula of the sphere

struct SphereShot {
  LitScene lit;
  Pinhole camera = {160, 120, 300, 300, 80, 60};
  Rigid pose = {};
};

SphereShot ShootSphere(double albedo, double roughness) {
  Scene scene;
  scene.object = NamedShape("sphere");
  scene.object_material = {1.5, roughness};
  scene.object_texture.mean = albedo;
  scene.has_table = false;
  Progress silent;
  SphereShot shot{Illuminate(std::move(scene), silent)};
  const Eigen::Quaterniond turn(0.8, 0.3, -0.4, 0.2);
  shot.pose = {turn.normalized().toRotationMatrix(), Vector3d(0.3, -0.2, 5)};
  return shot;
}

// Calls f(stokes, normal in the camera frame, cosine of the exit angle, x, y) for each pixel well inside the
// sphere.
template <class F>
void ForEachSpherePixel(const SphereShot& shot, F&& f) {
  Progress silent;
  const Image<Eigen::Vector3f> image = RenderStokes(shot.lit, shot.camera, shot.pose, 1, silent);
  int count = 0;
  for (int v = 0; v < image.height(); ++v)
    for (int u = 0; u < image.width(); ++u) {
      const Vector3d ray = shot.camera.Ray(u + 0.5, v + 0.5), d = ray.normalized(), c = shot.pose.translation;
      const double along = d.dot(c), root = along * along - c.squaredNorm() + 1;
      if (root < 0.02) continue;
      const Vector3d n = (along - std::sqrt(root)) * d - c;
      f(Vector3d(image(u, v).cast<double>()), n, -n.dot(d), ray.x(), ray.y());
      ++count;
    }
  ASSERT_GT(count, 5000);
}

TEST(Simulator, AMirroringBlackSphereHasAopAcrossTheAzimuthAndFresnelsDop) {
  ForEachSpherePixel(ShootSphere(0, 0),
                     [](const Vector3d& s, const Vector3d& n, double cosine, double x, double y) {
                       if (cosine > 0.98) return;
                       const double aop = std::atan2(s[2], s[1]) / 2;
                       ASSERT_NEAR(std::remainder(aop - Azimuth(n, x, y) - kPi / 2, kPi), 0, 0.003);
                       ASSERT_NEAR(Dop(s), SpecularDop(std::acos(cosine), 1.5), 0.01);
                       ASSERT_NEAR(s[0], 0.5 * (Fresnel(cosine, 1.5).s + Fresnel(cosine, 1.5).p),
                                   0.01);  // the light around is 1
                     });
}

TEST(Simulator, WhatALambertianBodyAddsIsPolarizedAlongTheAzimuthWithFresnelsDop) {
  const SphereShot black = ShootSphere(0, 0), white = ShootSphere(0.9, 0);
  std::vector<Vector3d> without;
  ForEachSpherePixel(
      black, [&](const Vector3d& s, const Vector3d&, double, double, double) { without.push_back(s); });
  std::size_t i = 0;
  ForEachSpherePixel(white, [&](const Vector3d& both, const Vector3d& n, double cosine, double x, double y) {
    const Vector3d s = both - without[i++];
    if (cosine > 0.95 || cosine < 0.25) return;
    ASSERT_NEAR(std::remainder(std::atan2(s[2], s[1]) / 2 - Azimuth(n, x, y), kPi), 0, 0.01);
    ASSERT_NEAR(Dop(s), DiffuseDop(std::acos(cosine), 1.5), 0.003);
  });
}

TEST(Simulator, ANonAbsorbingSphereInEvenLightIsAsBrightAsTheLight) {
  // Energy: body and surface together send back what comes in, up to the fit of the internal reflectance.
  ForEachSpherePixel(ShootSphere(1, 0),
                     [](const Vector3d& s, const Vector3d&, double cosine, double, double) {
                       if (cosine > 0.6) {
                         ASSERT_NEAR(s[0], 1, 0.06);
                       }
                     });
}

TEST(Simulator, RoughSurfacesKeepTheAopOfSmoothOnes) {
  ForEachSpherePixel(ShootSphere(0, 0.25),
                     [](const Vector3d& s, const Vector3d& n, double cosine, double x, double y) {
                       if (cosine > 0.9 || cosine < 0.3) return;
                       const double aop = std::atan2(s[2], s[1]) / 2;
                       ASSERT_NEAR(std::remainder(aop - Azimuth(n, x, y) - kPi / 2, kPi), 0, 0.02);
                     });
}

TEST(Simulator, TheTableIsDarkerInTheShadowOfTheObject) {
  SceneOptions options;
  options.scene = "sphere";
  options.light = "overcast";
  options.blocks = false;
  Progress silent;
  const LitScene lit = Illuminate(MakeScene(options), silent);
  const float under = Sample(lit.table_light, 0.5, 0.5), far = Sample(lit.table_light, 0.05, 0.05);
  EXPECT_LT(under, 0.3f * far);
  EXPECT_GT(far, 0.0f);
}

}  // namespace
}  // namespace polarscan
