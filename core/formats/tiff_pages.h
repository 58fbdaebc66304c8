// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <vector>

#include "core/image.h"

namespace polarscan {

// One page of a TIFF as its tags say.
struct TiffPage {
  int directory = 0;  // its place in the file
  int width = 0, height = 0;
  int samples = 1;         // a pixel
  int bits = 0;            // a sample
  bool floating = false;   // else whole counts
  bool rgb = false;        // the first three samples are red, green, blue
  bool has_alpha = false;  // the last sample is said to be opacity
};

// Whether the file begins like a TIFF, whatever it is called.
bool IsTiff(const std::filesystem::path& path);

// The pages, without those that are marked as smaller previews of others. Throws Error if the file is no TIFF
// or cut off.
std::vector<TiffPage> TiffPages(const std::filesystem::path& path);

// A page's samples as stored, one plane each, in the file's order. Throws Error if it is not grey or RGB
// (more samples are allowed) of 8 or 16 bits or float32, or the file is damaged.
std::vector<Image<float>> ReadTiffSamples(const std::filesystem::path& path, const TiffPage& page);

}  // namespace polarscan
