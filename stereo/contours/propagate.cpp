// SPDX-License-Identifier: Apache-2.0
#include "stereo/contours/propagate.h"

#include <algorithm>
#include <optional>

#include "core/parallel.h"
#include "stereo/rounds/normals.h"

namespace polarscan {
namespace {

class Propagation {
 public:
  Propagation(const Problem& problem, const PropagationOptions& options)
      : problem_(problem), options_(options), scale_(problem.reference->camera) {}

  Distances FromDepths(const Image<float>& depth) const {
    Distances seeds{Image<float>(depth.width(), depth.height()), Image<float>(depth.width(), depth.height())};
    for (int y = 0; y < depth.height(); ++y)
      for (int x = 0; x < depth.width(); ++x)
        if (depth(x, y) > 0 && problem_.Active(x, y)) {
          seeds.u(x, y) = scale_.FromDepth(depth(x, y), problem_.Ray(x, y));
          seeds.weight(x, y) = 1;
        }
    return seeds;
  }

  // Within the view's depth range; u: empty: nothing is known.
  Image<float> ToDepths(const Image<float>& u, int width, int height) const {
    Image<float> depth(width, height);
    for (int y = 0; y < height && !u.empty(); ++y)
      for (int x = 0; x < width; ++x)
        if (problem_.Active(x, y))
          depth(x, y) =
              std::clamp(scale_.ToDepth(u(x, y), problem_.Ray(x, y)), problem_.depth_min, problem_.depth_max);
    return depth;
  }

  Distances Weighted(const Distances& seeds, Distances traced) const {
    for (std::size_t i = 0; i < traced.weight.size(); ++i)
      if (seeds.weight.pixels()[i] <= 0) traced.weight.pixels()[i] *= options_.contours;
    return traced;
  }

  // The normals turned into the plane that the contours leave them, the more so the surer the contours are.
  void TurnToAzimuths(const ContourField& field, Image<Eigen::Vector3f>& normals) const {
    ParallelFor(0, normals.height(), [&](int y) {
      for (int x = 0; x < normals.width(); ++x) {
        Eigen::Vector3f& normal = normals(x, y);
        if (normal.isZero()) continue;
        const Eigen::Vector3f tangent = field.Tangent(problem_, x, y);
        const float sure = field.At({float(x), float(y)}).norm();
        normal = (normal - sure * normal.dot(tangent) * tangent).normalized();
      }
    });
  }

 private:
  const Problem& problem_;
  const PropagationOptions& options_;
  const LogDistance scale_;
};

Image<std::uint8_t> Reached(const Distances& traced) {
  Image<std::uint8_t> reached(traced.u.width(), traced.u.height());
  for (std::size_t i = 0; i < reached.size(); ++i)
    reached.pixels()[i] = traced.weight.pixels()[i] > 0 ? 255 : 0;
  return reached;
}

}  // namespace

Propagated PropagateDepth(const Problem& problem, const DepthNormalMap& reliable,
                          const PropagationOptions& options, const Progress& progress) {
  const Propagation propagation(problem, options);
  const int width = reliable.depth.width(), height = reliable.depth.height();
  const Distances seeds = propagation.FromDepths(reliable.depth);
  Distances known = seeds;
  std::optional<ContourField> field;
  DepthNormalMap map = reliable;
  for (int turn = 0; turn < options.turns; ++turn) {
    if (!problem.reference->polar.empty()) {
      field.emplace(problem, LabelReflection(problem, map.normal, options.labels));
      known = TraceContours(problem, *field, seeds, options.trace);
    }
    const Image<float> u = FitDistances(problem, propagation.Weighted(seeds, known),
                                        field ? &*field : nullptr, options.fit, progress);
    map.depth = propagation.ToDepths(u, width, height);
    map.normal = DepthNormals(problem, map.depth);
  }
  if (field) propagation.TurnToAzimuths(*field, map.normal);
  return {std::move(map), Reached(known)};
}

}  // namespace polarscan
