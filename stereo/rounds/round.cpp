// SPDX-License-Identifier: Apache-2.0
#include "stereo/rounds/round.h"

#include "stereo/rounds/integrate.h"
#include "stereo/rounds/normals.h"
#include "stereo/rounds/vote.h"

namespace polarscan {

RoundResult RunRound(const Problem& problem, const DepthNormalMap& own, const StereoOptions& options,
                     float sharpness) {
  const float sigma = float(options.vote_sigma) * sharpness;
  // With a mask nothing lies behind the object, and chance in front of it would only be trusted.
  const float trust = problem.reference->mask.empty() ? float(options.vote_trust) : 0;
  const Vote vote = VoteForDepth(problem, own, {sigma, float(options.vote_support), trust});
  DepthNormalMap map{vote.depth, own.normal};
  if (!options.depth_normal && problem.reference->polar.empty()) return {std::move(map), vote.confidence};
  IntegrationOptions integration;
  integration.data_weight = float(options.integration_weight);
  for (int i = 0; i < options.round_iterations; ++i) {
    NormalOptions normals;
    normals.sigma = sigma;
    map.normal = SolveNormals(problem, map.depth, map.normal, normals);
    if (options.depth_normal)
      map.depth = IntegrateNormals(problem.reference->camera, vote.depth, vote.confidence, map.normal,
                                   map.depth, integration);
  }
  return {std::move(map), vote.confidence};
}

}  // namespace polarscan
