// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <vector>

#include "core/progress.h"
#include "stereo/sfm/model/model.h"
#include "stereo/workspace.h"

namespace polarscan {

// A sparse point and the dense views that see it (indices, ascending, no view twice).
struct ScenePoint {
  Eigen::Vector3d position;
  std::vector<int> views;
};

// The model's points in front of at least two of the views, which are found in the model by name.
std::vector<ScenePoint> ScenePoints(const SparseModel& model, const std::vector<DenseView>& views);

// z of a world point in the view's camera frame.
double Depth(const DenseView& view, const Eigen::Vector3d& point);

// The point with the least sum of squared distances to all optical axes; none if the axes are nearly parallel
// (or all look away from it): then the views say nothing about where the scene is.
std::optional<Eigen::Vector3d> AxesIntersection(const std::vector<DenseView>& views);

// For each view the depth of what it looks at: median of its points, else the depth of the axes'
// intersection, else ten times the usual distance to the next camera. World units, > 0.
std::vector<double> FocusDepths(const std::vector<DenseView>& views, const std::vector<ScenePoint>& points);

// Counts the model's coordinates from a place near it, and says so, where it lies so far from 0 that files in
// single precision would lose detail (core/similarity.h).
void MoveToLocalFrame(SparseModel& model, Progress& progress);

}  // namespace polarscan
