// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <vector>

#include "fusion/surface/inverse_rendering/vertex_samples.h"

namespace polarscan {

// Light of one view as coefficients of the spherical harmonics up to second order, or those at one normal;
// grey, in units of the pictures' mean. World frame.
using Harmonics = Eigen::Matrix<double, 9, 1>;

// (1, ny, nz, nx, nx ny, ny nz, nz^2 - 1/3, nx nz, nx^2 - ny^2) of a unit normal: the harmonics without their
// constants, as in Multi-View Inverse Rendering (Kim, Torii, Okutomi, ECCV 2016). A surface of albedo K
// reflects K light.HarmonicsAt(n).
Harmonics HarmonicsAt(const Eigen::Vector3d& n);

// Their derivatives by n, one row a harmonic.
Eigen::Matrix<double, 9, 3> HarmonicSlopes(const Eigen::Vector3d& n);

// The light of each view that minimises the photometric term, sum over samples of (K shading - intensity)^2 /
// (views of the vertex), for these unit normals and albedos: a linear system of nine unknowns, made definite
// by a millionth of its mean diagonal. Zero for a view without samples. The same for any number of threads.
std::vector<Harmonics> FitLights(const std::vector<Eigen::Vector3d>& normals,
                                 const std::vector<double>& albedo, const VertexSamples& samples,
                                 std::size_t views);

}  // namespace polarscan
