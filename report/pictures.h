// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/image.h"
#include "demosaic/stokes.h"

namespace polarscan {

// Where one view's files may lie, and what of them could be read, made small. Stokes components are averaged,
// never angles; small Stokes images have no noise, S0 = 0 marks an invalid pixel.
struct Thumbnails {
  std::string name;
  std::filesystem::path stokes_path, picture_path, depth_path, normal_path, mask_path;
  std::filesystem::path depth_error_path, normal_error_path;  // pictures that evaluate left
  std::optional<StokesImage> stokes;
  double dop_noise = 0;  // median standard deviation of DoP at full size, dark pixels left out
  Image<Rgb8> picture, depth_error, normal_error;
  Image<float> depth;
  Image<Eigen::Vector3f> normal;
  double depth_share = 0;  // of the pixels that have a depth, inside the mask if there is one
  bool masked = false;
  std::vector<std::string> damaged;  // messages
};

// Reads what is there; the longest side of the small pictures is at most `longest` px. A damaged file goes to
// `damaged`.
void ReadSmall(Thumbnails& view, int longest);

// Appends the degrees of polarization of the pixels that are not too dark to tell.
void AppendDop(const StokesImage& small, std::vector<double>& dop);

// {name, pictures {s0, dop, aop, depth, normal, depth_error, normal_error: JPEG in base64}, depth {near, far,
// share, masked}}, each if the view has it. dop_full: degree of polarization shown at full strength; 0: no
// dop and aop.
nlohmann::json ToPage(const Thumbnails& view, double dop_full);

}  // namespace polarscan
