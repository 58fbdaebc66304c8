// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>
#include <vector>

#include "core/image.h"

namespace polarscan {

// A plane of floats over rows [top, bottom) of a picture and some of its columns, `width` of them. Rows have
// kMargin floats more at either end, 0 as long as nobody writes there, so that vectors and filters need not
// ask where a row ends.
class BandPlane {
 public:
  static constexpr int kMargin = 16;
  BandPlane(int top, int bottom, int width)
      : top_(top),
        bottom_(bottom),
        width_(width),
        stride_((width + kMargin - 1) / kMargin * kMargin + 2 * kMargin),
        values_(std::size_t(bottom - top) * std::size_t(stride_)) {}

  float* Row(int y) { return values_.data() + Start(y); }
  const float* Row(int y) const { return values_.data() + Start(y); }
  int top() const { return top_; }
  int bottom() const { return bottom_; }
  int width() const { return width_; }

 private:
  std::size_t Start(int y) const { return std::size_t(y - top_) * std::size_t(stride_) + kMargin; }

  int top_, bottom_, width_, stride_;
  std::vector<float> values_;
};

// out = sums over the window around each pixel of rows [begin, end) of a x b, by taps[|dx|] taps[|dy|]; fewer
// than kMargin taps. Rows outside of the planes count as 0. scratch: as large as a. Where b is a itself, its
// squares.
void WindowSums(const BandPlane& a, const BandPlane& b, std::span<const float> taps, int begin, int end,
                BandPlane& scratch, BandPlane& out);

// A camera that looks at points p: pixel centres at integer + 0.5.
struct RowCamera {
  float fx, fy, cx, cy;
  float tx, ty, tz;  // added to the points
};

// out = the picture at scale * (x, y, z) + t, bilinear, less 0.5; 0 where seen is 0. Points that are seen
// must lie inside the picture.
void DrawRow(const Image<float>& picture, const RowCamera& camera, float scale, const float* x,
             const float* y, const float* z, const float* seen, int count, float* out);

// Window sums of one row, by their weights w.
struct RowSums {
  const float *w, *r, *rr, *s, *ss, *rs;
};

// out = 1 - NCC, with epsilon added to variances and covariance.
void MatchingCostRow(const RowSums& sums, float epsilon, int count, float* out);

}  // namespace polarscan
