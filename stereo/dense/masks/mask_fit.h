// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <string>

#include "core/progress.h"
#include "stereo/workspace.h"

namespace polarscan {

// How well the masks of a workspace fit its cameras: of each view with a mask, the share of its pixels on
// whose rays, within the view's depths, two or more of the other masks exclude every place. 0 where all of
// the object may be; near 1 for masks that are inverted, turned or another view's, and for all of them where
// the poses are wrong. Asks some hundred pixels of at most 40 views, at a resolution of at most 400 px.
// Empty: fewer than four masks.
std::map<std::string, double> MasksThatDoNotFit(const Workspace& workspace, Progress& progress);

// What is to be said of it; empty: nothing.
std::string MaskFitWords(const std::map<std::string, double>& lost);

}  // namespace polarscan
