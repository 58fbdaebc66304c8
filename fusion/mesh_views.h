// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "core/mesh.h"
#include "core/progress.h"
#include "stereo/polarpms/hypotheses.h"
#include "stereo/workspace.h"

namespace polarscan {

// Which vertices each view sees, [view][vertex]: inside of its picture, facing it by more than a tenth of
// their direction, and nothing of the mesh in between.
std::vector<std::vector<bool>> VisibleVertices(const TriangleMesh& mesh, const Workspace& workspace,
                                               Progress& progress);

// What the AoP of all views says about each vertex's normal, world frame (AopConstraint,
// stereo/polarpms/hypotheses.h). The AoP is interpolated between pixels as S1 and S2 are, not as an angle.
using VertexConstraints = std::vector<std::vector<AopConstraint>>;

// One view's sample at image point (u, v), interpolated; weight 0 outside of the picture.
PolarSample SamplePolar(const Image<PolarSample>& polar, double u, double v);

// Adds one view's constraints; `visible`: one of VisibleVertices. Nothing if the view is not polarized.
void AddAopConstraints(const TriangleMesh& mesh, const StereoView& view, const std::vector<bool>& visible,
                       VertexConstraints& constraints);

}  // namespace polarscan
