// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/cache.h"
#include "stereo/costs/problem.h"
#include "stereo/options.h"
#include "stereo/workspace.h"

namespace polarscan {

// What every schedule's stage needs of the workspace: its maps, and the caches' values made into problems.

// Views and maps as they are asked for, each with half of options.cache_gb. They last no longer than the
// workspace and the options. scale: GrayScale of the workspace.
Cache<StereoView> CachedViews(const Workspace& workspace, const StereoOptions& options, float scale,
                              int halvings = 0);
Cache<DepthNormalMap> CachedMaps(const StereoOptions& options, std::function<DepthNormalMap(int)> read);

// The maps of that kind, of the view's window. On disk kFinalMaps have the whole picture's size, others the
// window's. Throw Error on a missing or damaged file.
DepthNormalMap ReadMaps(const Workspace& workspace, int view, const MapKind& kind);
void WriteMaps(const Workspace& workspace, int view, const MapKind& kind, const DepthNormalMap& map);

// Removes the maps of steps (kPassingMaps): of a run that was killed before it could, or of one with other
// options. Not while other shards work.
void RemovePassingMaps(const Workspace& workspace);

// The view with its best sources; `maps`: null for a problem without geometric terms. reference: the view's.
// Throws Error if no other view looks at the same place.
Problem MakeProblem(const Workspace& workspace, int view, const StereoOptions& options,
                    const StereoView& reference, Cache<StereoView>& views, Cache<DepthNormalMap>* maps);

// The view with all that vote for its depths (options.vote_angle_deg, vote_views), with their maps: those
// whose direction to the middle of this view's scene differs least, nearest first; one of each place
// (SamePlace), and none of the view's own.
Problem VotersProblem(const Workspace& workspace, int view, const StereoOptions& options,
                      const StereoView& reference, Cache<StereoView>& views, Cache<DepthNormalMap>& maps);

// Every other view that has a silhouette; none if silhouettes are switched off.
std::vector<Source> SourcesWithSilhouettes(const Workspace& workspace, int view, const StereoOptions& options,
                                           const StereoView& reference, Cache<StereoView>& views);

}  // namespace polarscan
