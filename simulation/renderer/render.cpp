// SPDX-License-Identifier: Apache-2.0
#include "simulation/renderer/render.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/parallel.h"

namespace polarscan {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Places of the samples within a pixel, and for each its facets: a Hammersley set dealt out so that a pixel
// sees all of it, and every facet also mirrored at the plane of incidence (else it would turn the angle of
// polarization).
struct PixelPattern {
  struct Sample {
    Vector2d place;
    FacetSamples facets;
  };
  std::vector<Sample> samples;
};

double RadicalInverse(int i) {
  double value = 0;
  for (double digit = 0.5; i; i >>= 1, digit /= 2) value += digit * (i & 1);
  return value;
}

// Facet i of `count`.
DiscPoint Facet(int i, int count, int side) {
  return DiscPoint((i + 0.5) / count, RadicalInverse(i) + 0.5 / count, side);
}

PixelPattern MakePattern(int per_axis) {
  const int count = per_axis * per_axis, facets = std::max(count, 4);
  PixelPattern pattern;
  for (int i = 0; i < count; ++i) {
    PixelPattern::Sample sample{{(i % per_axis + 0.5) / per_axis, (i / per_axis + 0.5) / per_axis}, {}};
    for (int k = i; k < facets; k += count)
      for (int side : {1, -1}) sample.facets.object.push_back(Facet(k, facets, side));
    sample.facets.table = sample.facets.object;
    if (count % 2 == 0) sample.facets.table = {Facet(i / 2, count / 2, i % 2 ? -1 : 1)};
    pattern.samples.push_back(sample);
  }
  return pattern;
}

// Everything that is the same for all pixels of a frame.
struct RenderedCamera {
  const LitScene& lit;
  const Pinhole& camera;
  Eigen::Matrix3d cam_from_world;
  Vector3d center;

  RenderedCamera(const LitScene& scene, const Pinhole& pinhole, const Rigid& pose)
      : lit(scene), camera(pinhole), cam_from_world(pose.rotation), center(pose.Center()) {}

  Vector3d WorldRay(double u, double v) const {
    return (cam_from_world.transpose() * camera.Ray(u, v)).normalized();
  }
  Vector3d Pixel(int x, int y, const PixelPattern& pattern) const {
    Vector3d sum = Vector3d::Zero();
    for (const auto& sample : pattern.samples) {
      const double u = x + sample.place.x(), v = y + sample.place.y();
      const Vector3d ray = camera.Ray(u, v);
      sum += StokesAlong(lit, center, WorldRay(u, v), cam_from_world, PolarFrame(ray.x(), ray.y()),
                         sample.facets);
    }
    return sum / double(pattern.samples.size());
  }
};

// What a polarizer at the angle passes.
double Through(const Vector3d& stokes, int angle_deg) {
  switch (angle_deg) {
    case 0:
      return 0.5 * (stokes[0] + stokes[1]);
    case 45:
      return 0.5 * (stokes[0] + stokes[2]);
    case 90:
      return 0.5 * (stokes[0] - stokes[1]);
    default:
      return 0.5 * (stokes[0] - stokes[2]);
  }
}

}  // namespace

Image<Eigen::Vector3f> RenderStokes(const LitScene& lit, const Pinhole& camera, const Rigid& cam_from_world,
                                    int samples, const Progress& progress) {
  const RenderedCamera view(lit, camera, cam_from_world);
  const PixelPattern pattern = MakePattern(samples);
  Image<Eigen::Vector3f> stokes(camera.width, camera.height, Eigen::Vector3f::Zero());
  ParallelFor(0, camera.height, [&](int y) {
    progress.Check();
    for (int x = 0; x < camera.width; ++x) stokes(x, y) = view.Pixel(x, y, pattern).cast<float>();
  });
  return stokes;
}

Image<std::uint16_t> RenderFrame(const LitScene& lit, const Pinhole& camera, const Rigid& cam_from_world,
                                 const FrameSettings& settings, Progress& progress) {
  const RenderedCamera view(lit, camera, cam_from_world);
  const PixelPattern pattern = MakePattern(settings.samples);
  Image<std::uint16_t> frame(camera.width, camera.height);
  ParallelFor(0, camera.height, [&](int y) {
    progress.Check();
    for (int x = 0; x < camera.width; ++x) {
      const double signal = Through(view.Pixel(x, y, pattern), settings.sensor.layout.AngleAt(x, y));
      Random random(settings.seed, 4, settings.frame,
                    std::uint64_t(y) * std::uint64_t(camera.width) + std::uint64_t(x));
      frame(x, y) = settings.sensor.Count(settings.gain * signal, random);
    }
    progress.Advance();
  });
  return frame;
}

Image<std::uint8_t> RenderMask(const LitScene& lit, const Pinhole& camera, const Rigid& cam_from_world,
                               const Progress& progress) {
  const RenderedCamera view(lit, camera, cam_from_world);
  Image<std::uint8_t> mask(camera.width, camera.height);
  ParallelFor(0, camera.height, [&](int y) {
    progress.Check();
    for (int x = 0; x < camera.width; ++x) {
      const Meeting m = Meet(lit, view.center, view.WorldRay(x + 0.5, y + 0.5), true);
      mask(x, y) = m.thing == Meeting::kObject ? 255 : 0;
    }
  });
  return mask;
}

double AutomaticGain(const LitScene& lit, const Pinhole& camera, const std::vector<SimulatedPose>& views,
                     const Progress& progress) {
  const Pinhole small = camera.Resized(std::max(1, camera.width / 10), std::max(1, camera.height / 10));
  std::vector<float> brightest;
  for (const SimulatedPose& v : views) {
    const Image<Eigen::Vector3f> stokes = RenderStokes(lit, small, v.cam_from_world, 1, progress);
    for (const Eigen::Vector3f& s : stokes.pixels())
      if (s[1] != 0 || s[2] != 0)
        brightest.push_back(0.5f * (s[0] + std::max(std::abs(s[1]), std::abs(s[2]))));
  }
  if (brightest.empty()) return 1;
  const auto place = brightest.begin() + std::ptrdiff_t(0.995 * double(brightest.size() - 1));
  std::nth_element(brightest.begin(), place, brightest.end());
  return 1 / double(*place);
}

}  // namespace polarscan
