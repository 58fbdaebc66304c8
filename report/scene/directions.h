// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace polarscan {

// A camera as seen from the object's centre, display frame (y up).
struct CameraPlace {
  int view;  // index into the page's views
  std::string name;
  Eigen::Vector3d direction;  // unit
};

// Directions from the object's centre, unit, display frame: azimuth from the front (z) to the right (x),
// elevation upwards (y), degrees.
Eigen::Vector3d Direction(double azimuth_deg, double elevation_deg);
double AzimuthDeg(const Eigen::Vector3d& direction);  // [0, 360)
double ElevationDeg(const Eigen::Vector3d& direction);

// Degrees between a direction and the nearest camera's; 180 if there is none.
double ToNearestCamera(const Eigen::Vector3d& direction, const std::vector<CameraPlace>& cameras);

// Where a person stands who looks from there, by the nearest camera: "straight above", "40 degrees to the
// right of 012 and 25 degrees higher" (right as that camera sees it). There must be a camera.
std::string Where(const Eigen::Vector3d& direction, const std::vector<CameraPlace>& cameras);

// The emptiest directions from `lowest_deg` of elevation up: each the farthest from all cameras and from the
// ones before, as long as it is more than `gap_deg` away; at most `most`. On a grid of 5 degrees.
std::vector<Eigen::Vector3d> EmptyDirections(const std::vector<CameraPlace>& cameras, double lowest_deg,
                                             double gap_deg, int most);

// The direction that most of these unit normals face: the mean of the largest group of 26 (the ways to a
// cube's faces, edges and corners). There must be one.
Eigen::Vector3d MainDirection(const std::vector<Eigen::Vector3d>& normals);

}  // namespace polarscan
