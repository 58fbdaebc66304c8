// SPDX-License-Identifier: Apache-2.0
#include "simulation/scene/environment.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "simulation/scene/texture.h"

namespace polarscan {
namespace {

constexpr int kMapSize = 512;
constexpr double kDegrees = 180 / std::numbers::pi;

Eigen::Vector3d FromOctahedron(double u, double v) {
  const double x = 2 * u - 1, y = 2 * v - 1;
  Eigen::Vector3d d(x, 1 - std::abs(x) - std::abs(y), y);
  if (d.y() < 0) {
    d.x() = std::copysign(1 - std::abs(y), x);
    d.z() = std::copysign(1 - std::abs(x), y);
  }
  return d.normalized();
}

double Glow(const Environment::Lamp& lamp, const Eigen::Vector3d& d) {
  const double azimuth = std::atan2(d.x(), d.z()) * kDegrees, elevation = std::asin(d.y()) * kDegrees;
  const double across = std::remainder(azimuth - lamp.azimuth_deg, 360.0) * std::cos(elevation / kDegrees);
  const double edge = std::max(std::abs(across) - lamp.width_deg / 2,
                               std::abs(elevation - lamp.elevation_deg) - lamp.height_deg / 2);
  return lamp.radiance / (1 + std::exp(4 * edge / lamp.edge_deg));
}

}  // namespace

Environment::Environment(double zenith, double horizon, double floor, const std::vector<Lamp>& lamps)
    : map_(kMapSize, kMapSize) {
  ParallelFor(0, kMapSize, [&](int y) {
    for (int x = 0; x < kMapSize; ++x) {
      const Eigen::Vector3d d = FromOctahedron((x + 0.5) / kMapSize, (y + 0.5) / kMapSize);
      double radiance = d.y() > 0 ? horizon + (zenith - horizon) * d.y() : floor;
      for (const Lamp& lamp : lamps) radiance += Glow(lamp, d);
      map_(x, y) = float(radiance);
    }
  });
}

double Environment::Radiance(const Eigen::Vector3d& d) const {
  const double scale = 1 / (std::abs(d.x()) + std::abs(d.y()) + std::abs(d.z()));
  double x = d.x() * scale, y = d.z() * scale;
  if (d.y() < 0) {
    const double folded = std::copysign(1 - std::abs(y), x);
    y = std::copysign(1 - std::abs(x), y);
    x = folded;
  }
  return Sample(map_, 0.5 * (x + 1), 0.5 * (y + 1));
}

Environment NamedEnvironment(const std::string& name) {
  if (name == "uniform") return Environment(1.0);
  if (name == "overcast") return {1.4, 0.6, 0.2, {{40, 48, 60, 36, 1.2, 14}}};
  if (name == "studio")
    return {
        0.40, 0.20, 0.08, {{-40, 48, 62, 42, 3.4, 9}, {75, 25, 40, 60, 1.2, 9}, {190, 35, 56, 40, 2.2, 9}}};
  throw Error("no such light", name, "Try 'studio', 'overcast' or 'uniform'");
}

std::vector<std::string> EnvironmentNames() { return {"studio", "overcast", "uniform"}; }

}  // namespace polarscan
