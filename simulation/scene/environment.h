// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/image.h"

namespace polarscan {

// Unpolarized light from far away, radiance per direction (world, y up): a sky gradient, a dim floor below
// the horizon, and soft-edged rectangular lamps. Kept as an octahedral map (Cigolle et al., JCGT 2014), 512 x
// 512.
class Environment {
 public:
  // Angles in degrees: centre (azimuth from +z towards +x, elevation), full width and height, width of the
  // soft edge.
  struct Lamp {
    double azimuth_deg, elevation_deg, width_deg, height_deg, radiance, edge_deg;
  };

  // sky: radiance at the zenith and at the horizon; floor: radiance below.
  Environment(double zenith, double horizon, double floor, const std::vector<Lamp>& lamps);
  // The same radiance from everywhere.
  explicit Environment(double radiance) : map_(2, 2, float(radiance)) {}

  // `direction` is unit and points away from the scene.
  double Radiance(const Eigen::Vector3d& direction) const;

 private:
  Image<float> map_;
};

// "studio": three softboxes over a dim sky; "overcast": a bright sky with one soft lamp; "uniform": 1 from
// everywhere.
Environment NamedEnvironment(const std::string& name);
std::vector<std::string> EnvironmentNames();

}  // namespace polarscan
