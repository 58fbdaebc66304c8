// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "core/mesh.h"
#include "core/options.h"
#include "core/progress.h"
#include "core/similarity.h"
#include "evaluation/result.h"
#include "stereo/workspace.h"

namespace polarscan {

struct EvaluateOptions {
  std::string kind = "auto";  // of maps: auto (geometric if there are any), geometric, photometric
  bool masks = false;         // only pixels inside of the workspace's masks are object pixels
  double unit = 0;  // length, in the truth's units, that lengths below are counted in; 0: see ObjectUnit
  double depth_penalty = 0.05, normal_penalty_deg = 90;
  std::string depth_thresholds = "0.001,0.002,0.005,0.01,0.02";
  std::string normal_thresholds_deg = "2.5,5,10,15,20,30";
  std::string cloud_thresholds = "0.001,0.002,0.005,0.01,0.02";
  int samples = 500000;
  double cap = 0;   // greatest distance counted in the cloud's means; 0: none
  double crop = 0;  // cloud points farther from the object do not count; 0: all count
  int seen_by = 2;  // cameras that must see a sample for it to count in completeness; 0: all samples count
};
OptionTable Table(EvaluateOptions& options);

// What is true: the object, and what stands around it (a table), which hides parts of the object and catches
// points that are none of the object's.
struct Truth {
  Truth(TriangleMesh object, std::vector<TriangleMesh> surroundings);
  const TriangleMesh& object() const { return caster.meshes()[0]; }

  RayCaster caster;  // mesh 0 is the object
};

// The object's bounding radius rounded to 1, 2 or 5 times a power of ten: 1 for an object of radius 1.
double ObjectUnit(const TriangleMesh& object);

// Errors at the pixels of one view: NaN where the object is not, infinite where it is but nothing was
// estimated.
struct ErrorMaps {
  Image<float> depth;       // units of the truth
  Image<float> normal_deg;  // empty if the view has no normals
};
using ErrorMapSink = std::function<void(const std::string& view, const ErrorMaps& errors)>;
using PointErrorSink = std::function<void(const std::vector<double>& errors)>;

// Depth and normal errors of a workspace's maps against the truth, cast through the pixel centres of its
// cameras after truth_from_scan has moved them (and scaled the depths). Object pixels: the ray meets the
// object before its surroundings. Curves go up to the greatest threshold. Views without maps are left out and
// counted. `sink` gets the errors of each view, in order. Throws Error if there are none or one is damaged.
MapsEvaluation EvaluateMaps(const Workspace& workspace, const Similarity& truth_from_scan, const Truth& truth,
                            const EvaluateOptions& options, Progress& progress,
                            const ErrorMapSink& sink = {});

// Accuracy (distance of the points, in the truth's frame, to the object's surface, exact), completeness
// (distance of samples of the surface to the nearest point), and per threshold precision, recall and F. With
// cameras, only samples that options.seen_by of them see count: in the picture, from the front, nothing
// between. Points nearer to the surroundings than to the object are the surroundings' and do not count; nor
// do points beyond options.crop. Curves go up to the greatest threshold. `sink` gets the distance of every
// point to the object. Throws Error if none is left.
CloudEvaluation EvaluateCloud(const std::vector<Eigen::Vector3d>& points,
                              const std::vector<DenseView>& cameras, const Truth& truth,
                              const EvaluateOptions& options, std::uint64_t seed, Progress& progress,
                              const PointErrorSink& sink = {});

}  // namespace polarscan
