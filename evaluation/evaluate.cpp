// SPDX-License-Identifier: Apache-2.0
#include "evaluation/evaluate.h"

#include <cmath>

#include "core/error.h"
#include "fusion/surface/surface.h"

namespace polarscan {
namespace {

std::vector<TriangleMesh> ObjectFirst(TriangleMesh object, std::vector<TriangleMesh> surroundings) {
  if (object.triangles.empty()) throw Error("the true mesh has no triangles", "evaluation");
  surroundings.insert(surroundings.begin(), std::move(object));
  return surroundings;
}

}  // namespace

OptionTable Table(EvaluateOptions& o) {
  return {
      {"kind",
       &o.kind,
       "Maps to compare; auto: geometric if there are any",
       "",
       0,
       0,
       {"auto", "geometric", "photometric"}},
      {"inside-masks", &o.masks, "Count only pixels inside of the scan's masks as the object's"},
      {"unit", &o.unit,
       "Length that the thresholds, the penalty, --cap and --crop are counted in, in the truth's units; 0: "
       "the object's radius, rounded to 1, 2 or 5 times a power of ten",
       "", 0, 1e300},
      {"depth-penalty", &o.depth_penalty,
       "Depth error of a missing pixel, and the greatest, in figures over all", "units", 0, 1e300},
      {"normal-penalty", &o.normal_penalty_deg, "The same for normals", "deg", 0, 180},
      {"depth-thresholds", &o.depth_thresholds, "Shares of depth errors below these are given (units)"},
      {"normal-thresholds", &o.normal_thresholds_deg,
       "Shares of normal errors below these are given (degrees)"},
      {"cloud-thresholds", &o.cloud_thresholds,
       "Precision, recall and F are given at these distances (units)"},
      {"samples", &o.samples, "Points on the true surface for completeness", "points", 1, 1e9},
      {"cap", &o.cap,
       "Greatest distance counted in the cloud's means, so that strays do not rule them; 0: none", "units", 0,
       1e300},
      {"crop", &o.crop,
       "Points farther from the object do not count (for scenes with more in them than is known); 0: all "
       "count",
       "units", 0, 1e300},
      {"seen-by", &o.seen_by, "Completeness counts surface that this many cameras see; 0: all of it",
       "cameras", 0, 100000},
  };
}

Truth::Truth(TriangleMesh object, std::vector<TriangleMesh> surroundings)
    : caster(ObjectFirst(std::move(object), std::move(surroundings))) {}

double ObjectUnit(const TriangleMesh& object) {
  const double radius = BoundingRadius(object);
  if (!(radius > 0) || !std::isfinite(radius)) throw Error("the true mesh has no extent", "evaluation");
  const double power = std::pow(10, std::floor(std::log10(radius))),
               digit = radius / power;  // 1 <= digit < 10
  const double rounded = digit < std::sqrt(2.)    ? 1
                         : digit < std::sqrt(10.) ? 2
                         : digit < std::sqrt(50.) ? 5
                                                  : 10;
  return rounded * power;
}

}  // namespace polarscan
