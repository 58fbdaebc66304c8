// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <optional>

#include "core/camera.h"
#include "core/image.h"

namespace polarscan {

// The normal of the plane through the depths within `radius` pixels (inverse depth is linear on a plane); none if
// fewer than half of them are there. Camera frame, unit, facing the camera. Wrong polarization bends it little.
std::optional<Eigen::Vector3d> CoarseNormal(const Image<float>& depth, const Pinhole& camera, int x, int y,
                                            int radius);

// A radius for it: small beside the picture and beside an object of so many pixels.
int CoarseRadius(int width, std::size_t pixels);

}  // namespace polarscan
