// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace polarscan {

// Some points of a cloud, in the display frame (y up; world units): at most `max_points`, each with the same
// chance and the same ones every time, less those that lie far from the bulk.
struct CloudSample {
  std::size_t total = 0;                              // of the file
  std::size_t outside = 0;                            // of the sample, left out: further than 6 radii away
  Eigen::Vector3d center = Eigen::Vector3d::Zero();   // medians
  double radius = 0;                                  // that 95 % of the points lie within
  double spacing = 0;                                 // typical distance of neighbours
  std::vector<Eigen::Vector3d> points, normals;       // normals: empty if the file has none
  std::map<std::string, std::vector<double>> values;  // the file's other properties: red, dop, views, ...

  bool empty() const { return points.empty(); }
  bool Has(const std::string& name) const { return values.contains(name); }
};

// errors: a PLY file with property `error` of each of the cloud's points in their order
// (fusion/cloud_errors.h), or empty. Throws Error on a damaged or empty file, or if the two have different
// numbers of points.
CloudSample SampleCloud(const std::filesystem::path& ply, const std::filesystem::path& errors,
                        std::size_t max_points, const Eigen::Matrix3d& display_from_world);

}  // namespace polarscan
