// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "core/progress.h"
#include "stereo/options.h"
#include "stereo/workspace.h"

namespace polarscan {

// Ways to count the angles of polarization. Quarter-turns are left out: diffuse and specular light differ by
// one, so they do no harm.
enum class AopCount { kAsGiven, kMirrored, kShifted, kMirroredAndShifted };  // shifted: by 45 degrees

// How well AoP fit one normal at a place of the surface, counted as they are given and otherwise.
struct AopFit {
  int points = 0;    // places that were asked
  double given = 0;  // mean cosine of four times the angle between AoP and azimuth, -1 to 1
  AopCount other = AopCount::kMirrored;  // the best of the other ways ...
  double other_fit = 0;
  double sigmas = 0;  // ... and by how many of its standard deviations it is better
  // Whether the angles are certainly not counted as given. No where there is too little to tell.
  bool IsWrong() const;
};
nlohmann::json ToJson(const AopFit& fit);

struct AopFits {
  AopFit all;  // of the views together
  std::map<std::string, AopFit>
      odd{};  // of views whose own do not fit the others', but would, counted otherwise
};

// Asks the finished maps. Wrong angles have bent them, so neither normals nor small forms are believed: at
// each of some thousand places the normal is free within a cone around that of the depths far around it, and
// what is compared is how well the AoP of all views that see the place then fit together (weighted by their
// noise, options.aop_noise_deg). Then each view by itself: how its AoP fit the normals that the other views'
// ask for, where four see a place at least; not if all are wrong. Reads the maps and polarization of 40 views
// at most.
AopFits CheckAop(const Workspace& workspace, const StereoOptions& options, Progress& progress);

}  // namespace polarscan
