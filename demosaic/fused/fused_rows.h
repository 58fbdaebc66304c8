// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>

#include "demosaic/methods/linear.h"
#include "demosaic/sensor/pixel_format.h"

namespace polarscan::fused {

// The row loops of fused.h, compiled for each instruction set. Rows are padded: kBorder reflected pixels on
// the left, at least kBorder + kSlack readable ones on the right.
inline constexpr int kBorder = 16, kSlack = 32;

struct Light {
  float black = 0, scale = 1;  // light = (count - black) scale
};

// One row of samples that begins at a whole byte. Reads up to 64 bytes beyond its
// last sample, never at or beyond `end`.
void UnpackRow(Packing packing, int bits, const std::uint8_t* row, const std::uint8_t* end, int width,
               const Light& light, float* out);

// Where a row of results goes; dop and aop may be null.
struct OutRow {
  float *s0, *s1, *s2, *dop, *aop;
  int width;
};

// Share of the four means (own, row, column, across: bilinear.h) in S1 and S2 at even and odd columns.
struct StokesShares {
  float s1[4][2], s2[4][2];
};

// guide (null: none) adds twice itself to S0.
void BilinearRow(const float* above, const float* here, const float* below, const float* guide,
                 const StokesShares& shares, const OutRow& out);

// The three kernels of a layout on 2 M, and the share of each carrier's answer in S1 and S2 at even and odd
// columns of this row. rows[0 ... 6], the pixel's row in the middle.
struct LinearRowKernels {
  LinearKernels::Kernel s0, first, second;
  float s1[2][2], s2[2][2];
};
void LinearRow(const float* const* rows, const LinearRowKernels& kernels, const OutRow& out);

// A band of padded rows in, differences to the edge-aware guide (guide.h) and the guide out, for rows first
// ... last - 1 of the band and 2 columns beyond the picture on both sides. Rows first - 3 ... last + 2 are
// read. scratch: six bands.
struct Band {
  float* rows;  // row r begins, with its border, at rows + r stride
  std::size_t stride;
  int count, width;  // rows; pixels without the borders
};
void GuideRows(const Band& band, int first, int last, float* const* scratch, float* guide, float* difference);

}  // namespace polarscan::fused
