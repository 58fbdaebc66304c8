// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/image.h"
#include "core/progress.h"

namespace polarscan {

// Smooth random values in [-1, 1] over space: trilinear (smoothstep) value noise on a periodic 32^3 lattice.
class ValueNoise {
 public:
  explicit ValueNoise(std::uint64_t seed);
  double At(const Eigen::Vector3d& p) const;
  // Sum of `octaves`, each at twice the frequency and 0.7 times the weight; about [-1, 1].
  double Fractal(const Eigen::Vector3d& p, int octaves) const;

 private:
  std::vector<float> lattice_;
};

// Albedo of the object at a point of object space: mean + contrast * fractal noise. With `patches` about half
// of the surface keeps the mean exactly (what texture-less really is, and where photometric stereo matching
// has nothing).
struct SolidTexture {
  double mean = 0.35, contrast = 0;
  bool patches = false;
  ValueNoise noise{0};

  double At(const Eigen::Vector3d& p) const;
};

// A square print full of things that feature detectors like: discs, rings, boxes, triangles and scribbles
// over noise, as reflectance in 0.03 .. 0.45. `size` pixels a side.
Image<float> MakePrint(int size, std::uint64_t seed, const Progress& progress = {});

// Means of blocks of factor x factor pixels (sizes are multiples of factor).
Image<float> Shrink(const Image<float>& image, int factor);

// Bilinear, with (0, 0) and (1, 1) at the outer corners of the picture; clamped at the border.
float Sample(const Image<float>& image, double u, double v);

}  // namespace polarscan
