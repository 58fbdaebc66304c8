// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "fusion/mesh_topology.h"
#include "fusion/surface/inverse_rendering/vertex_cost.h"

namespace polarscan {

// A facet and those over its three edges.
using FacetStar = std::array<Triangle, 4>;

// By facet; none where an edge lies at a border, or more than two facets share it.
using FacetStars = std::vector<std::optional<FacetStar>>;
FacetStars MakeFacetStars(std::span<const Triangle> triangles);

// The geometric smoothness of one facet, as three residuals whose squares add up to
//   weight (phi / pi)^2.2,
// phi: angle between the facet's normal and the mean of its neighbours' normals, as in Polarimetric MVIR. A
// sphere costs nothing. Derivatives by Ceres' automatic differentiation.
struct FacetCost {
  std::unique_ptr<ceres::CostFunction> cost;
  std::vector<std::uint32_t> vertices;  // whose moves are its parameters, each one number
};
FacetCost MakeFacetCost(const MovingSurface& surface, const FacetStar& star, double weight);

// The photometric smoothness of an edge: one residual, weight^(1/2) times the difference of its albedos.
std::unique_ptr<ceres::CostFunction> MakeAlbedoCost(double weight);

// What keeps a vertex where it was: one residual, weight^(1/2) (x + before) of its move x; before: how far it
// lies from there already, along its normal, in units of x.
std::unique_ptr<ceres::CostFunction> MakeAnchorCost(double weight, double before);

}  // namespace polarscan
