// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/input/input.h"
#include "demosaic/method.h"
#include "fusion/cloud/fuse.h"
#include "pipeline/meshing.h"
#include "pipeline/scan.h"
#include "pipeline/stereo/stereo.h"
#include "stereo/dense/undistort.h"
#include "stereo/sfm/board/length_unit.h"
#include "stereo/sfm/sfm.h"

namespace polarscan {

// Opens the known poses that lie beside the input's pictures, if any, so that what is wrong with them shows
// before anything is made. Throws and warns as ReadKnownPoses and CheckKnownPoses do.
void CheckKnownPoses(const Input& input, Progress& progress);

// Throws Error if the input has fewer than two views, which show no depth.
void RequireTwoViews(const Input& input);

// Structure from motion's options where masks may have been switched off for the whole scan: then they are
// for poses too, unless they were asked for.
SfmOptions WithMasksOf(SfmOptions options, const UndistortOptions& dense);

// The stages of a scan: each calls its library function through Scan::Run, so that it is skipped where its
// result is valid, and records its options and counts. The order is that of the functions here.
void RunViews(Scan& scan, const Input& input, const DemosaicOptions& options);
void RunSfm(Scan& scan, const std::optional<std::filesystem::path>& known_model, const SfmOptions& options);
void RunDense(Scan& scan, const UndistortOptions& options);
void RunStereo(Scan& scan, const StereoOptions& options);
void RunFusion(Scan& scan, const FusionOptions& options);
void RunMesh(Scan& scan, const MeshOptions& options);

// Whether fusion left out views because of damaged maps: then it is done, but data was lost.
bool MapsWereDamaged(const Scan& scan);

// What its lengths are counted in, as scan.json says.
LengthUnit UnitOf(const Scan& scan);

// The options of the scan's stereo stage as scan.json holds them. Throws Error if it holds none.
StereoOptions RecordedStereoOptions(const Scan& scan);

}  // namespace polarscan
