// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/progress.h"
#include "stereo/workspace.h"

namespace polarscan {

// What the finished depth maps say of the set's polarization. It is wrong for all views alike where a camera's
// mounting is turned, its angles are counted the other way, or the gains of its four angles differ.
struct PolarizationFit {
  PolarizationCorrection correction;  // none, where nothing is clearly wrong
  // Whether something may be wrong, by much less. Maps that polarization helped to make tell no more: wrong angles
  // have bent them toward themselves.
  bool doubtful = false;
};

// At some ten thousand pixels the coarse normal of the depths has an azimuth; diffuse and specular light have S1
// and S2 along it or across, in either sense, so that (S1, S2) x (cos 2 azimuth, sin 2 azimuth) is 0. Turn and bias
// make that sum least (robustly), for angles as they are and mirrored. A correction is given where it is beyond
// doubt: beside what views differ by, and large enough to matter. A turn by 90 degrees is not told apart from none:
// it does no harm. kind: maps of half the size as often as `halvings` says; those of 40 views at most are read.
PolarizationFit FitPolarization(const Workspace& workspace, const MapKind& kind, int halvings,
                                Progress& progress);

// The workspace's correction with a better turn, from maps that were made with it: they know the shape better.
PolarizationCorrection RefinedTurn(const Workspace& workspace, const MapKind& kind, int halvings,
                                   Progress& progress);

// "the angles of polarization are turned by 5.2 degrees, ..."; empty for none.
std::string CorrectionWords(const PolarizationCorrection& correction);

}  // namespace polarscan
