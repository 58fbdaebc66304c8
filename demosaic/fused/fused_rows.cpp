// SPDX-License-Identifier: Apache-2.0
// Compiled once per instruction set by Highway (foreach_target.h includes this file again for each) and
// chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "demosaic/fused/fused_rows.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "demosaic/fused/fused_rows.h"

HWY_BEFORE_NAMESPACE();
namespace polarscan::fused::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using V = hn::Vec<Floats>;

// One value at even columns, another at odd ones.
#if HWY_TARGET == HWY_SCALAR
class Alternating {
 public:
  explicit Alternating(const float (&pair)[2], float factor = 1)
      : pair_{factor * pair[0], factor * pair[1]} {}
  V At(std::size_t x) const { return hn::Set(Floats(), pair_[x & 1]); }

 private:
  float pair_[2];
};
#else
class Alternating {
 public:
  explicit Alternating(const float (&pair)[2], float factor = 1)
      : lanes_(hn::OddEven(hn::Set(Floats(), factor * pair[1]), hn::Set(Floats(), factor * pair[0]))) {}
  V At(std::size_t) const { return lanes_; }

 private:
  V lanes_;
};
#endif

struct StokesVector {
  V s0, s1, s2;
};

// atan2(s2, s1) / 2 in [0, pi). Abramowitz, Stegun, Handbook of Mathematical Functions, 4.4.49.
V HalfAngle(V s1, V s2) {
  const Floats d;
  const V x = hn::Abs(s1), y = hn::Abs(s2), most = hn::Max(x, y);
  const V t = hn::Div(hn::Min(x, y), hn::Max(most, hn::Set(d, 1e-37f))), u = hn::Mul(t, t);
  V p = hn::MulAdd(u, hn::Set(d, 0.0208351f), hn::Set(d, -0.0851330f));
  p = hn::MulAdd(u, p, hn::Set(d, 0.1801410f));
  p = hn::MulAdd(u, p, hn::Set(d, -0.3302995f));
  p = hn::Mul(t, hn::MulAdd(u, p, hn::Set(d, 0.9998660f)));
  p = hn::IfThenElse(hn::Gt(y, x), hn::Sub(hn::Set(d, 1.57079637f), p), p);
  p = hn::IfThenElse(hn::Lt(s1, hn::Zero(d)), hn::Sub(hn::Set(d, 3.14159274f), p), p);
  const V half = hn::Mul(hn::Set(d, 0.5f), p), turned = hn::Sub(hn::Set(d, 3.14159274f), half);
  const V angle = hn::IfThenElse(hn::Lt(s2, hn::Zero(d)), turned, half);
  return hn::IfThenElse(hn::Lt(angle, hn::Set(d, 3.14159250f)), angle, hn::Zero(d));
}

V Degree(const StokesVector& s) {
  const Floats d;
  const V polarized = hn::Sqrt(hn::MulAdd(s.s1, s.s1, hn::Mul(s.s2, s.s2)));
  return hn::IfThenElseZero(hn::Gt(s.s0, hn::Zero(d)), hn::Div(polarized, s.s0));
}

// The first `count` lanes.
void StorePart(V v, std::size_t count, float* out) {
  HWY_ALIGN float lanes[16];
  hn::Store(v, Floats(), lanes);
  std::memcpy(out, lanes, count * sizeof(float));
}

// kAngles: dop and aop too. Outputs that the caches need not keep go past them where all rows are aligned
// alike. `compute` and `rows` hold values: what is left behind a pointer would be read again after every such
// store.
template <bool kAngles, class Compute>
void EmitRow(const OutRow rows, const Compute compute) {
  const Floats d;
  const std::size_t lanes = hn::Lanes(d), width = std::size_t(rows.width), bytes = lanes * sizeof(float);
  const auto part = [](const OutRow& out, const Compute& at, std::size_t x, std::size_t count) HWY_ATTR {
    const StokesVector s = at(x);
    StorePart(s.s0, count, out.s0 + x), StorePart(s.s1, count, out.s1 + x);
    StorePart(s.s2, count, out.s2 + x);
    if (kAngles) {
      StorePart(Degree(s), count, out.dop + x);
      StorePart(HalfAngle(s.s1, s.s2), count, out.aop + x);
    }
  };
  const auto misaligned = [&](const float* p) { return reinterpret_cast<std::uintptr_t>(p) % bytes; };
  const std::size_t off = misaligned(rows.s0);
  const bool stream = off % 8 == 0 && misaligned(rows.s1) == off && misaligned(rows.s2) == off &&
                      (!kAngles || (misaligned(rows.dop) == off && misaligned(rows.aop) == off));
  std::size_t x = stream && off ? std::min((bytes - off) / sizeof(float), width) : 0;
  if (x) part(OutRow(rows), Compute(compute), 0, x);
  if (stream) {
    const Compute at = compute;
    for (; x + lanes <= width; x += lanes) {
      const StokesVector s = at(x);
      hn::Stream(s.s0, d, rows.s0 + x), hn::Stream(s.s1, d, rows.s1 + x), hn::Stream(s.s2, d, rows.s2 + x);
      if (kAngles) {
        hn::Stream(Degree(s), d, rows.dop + x);
        hn::Stream(HalfAngle(s.s1, s.s2), d, rows.aop + x);
      }
    }
  } else {
    for (; x + lanes <= width; x += lanes) part(OutRow(rows), Compute(compute), x, lanes);
  }
  if (x < width) part(OutRow(rows), Compute(compute), x, width - x);
}

template <class Compute>
void Emit(const OutRow& out, const Compute& compute) {
  if (out.dop) {
    EmitRow<true>(out, compute);
  } else {
    EmitRow<false>(out, compute);
  }
}

void BilinearRow(const float* above, const float* here, const float* below, const float* guide,
                 const StokesShares& shares, const OutRow& out) {
  const Floats d;
  const Alternating own1(shares.s1[0]), row1(shares.s1[1], 0.5f), column1(shares.s1[2], 0.5f),
      corner1(shares.s1[3], 0.25f);
  const Alternating own2(shares.s2[0]), row2(shares.s2[1], 0.5f), column2(shares.s2[2], 0.5f),
      corner2(shares.s2[3], 0.25f);
  Emit(out, [=](std::size_t x) HWY_ATTR {
    const auto across = [&](std::size_t i)
                            HWY_ATTR { return hn::Add(hn::LoadU(d, above + i), hn::LoadU(d, below + i)); };
    // Sums of 1, 2, 2 and 4 samples.
    const V own = hn::LoadU(d, here + x);
    const V row = hn::Add(hn::LoadU(d, here + x - 1), hn::LoadU(d, here + x + 1));
    const V column = across(x), corner = hn::Add(across(x - 1), across(x + 1));
    StokesVector s;
    s.s0 = hn::MulAdd(hn::Set(d, 0.125f), corner, hn::Mul(hn::Set(d, 0.5f), own));
    s.s0 = hn::MulAdd(hn::Set(d, 0.25f), hn::Add(row, column), s.s0);
    if (guide) s.s0 = hn::MulAdd(hn::Set(d, 2.f), hn::LoadU(d, guide + x), s.s0);
    s.s1 = hn::MulAdd(own1.At(x), own, hn::Mul(row1.At(x), row));
    s.s1 = hn::MulAdd(column1.At(x), column, hn::MulAdd(corner1.At(x), corner, s.s1));
    s.s2 = hn::MulAdd(own2.At(x), own, hn::Mul(row2.At(x), row));
    s.s2 = hn::MulAdd(column2.At(x), column, hn::MulAdd(corner2.At(x), corner, s.s2));
    return s;
  });
}

void LinearRow(const float* const* rows, const LinearRowKernels& kernels, const OutRow& out) {
  const Floats d;
  const Alternating a1(kernels.s1[0]), b1(kernels.s1[1]), a2(kernels.s2[0]), b2(kernels.s2[1]);
  Emit(out, [&](std::size_t x) HWY_ATTR {
    V s0 = hn::Zero(d), first = s0, second = s0;
    for (std::size_t v = 0; v < 4; ++v) {
      const float *up = rows[3 - v] + x, *down = rows[3 + v] + x;
      const auto load = [&](std::ptrdiff_t i) HWY_ATTR {
        const V a = hn::LoadU(d, up + i);
        return v == 0 ? a : hn::Add(a, hn::LoadU(d, down + i));
      };
      for (std::size_t u = 0; u < 4; ++u) {
        const std::ptrdiff_t i = std::ptrdiff_t(u);
        const V sum = u == 0 ? load(0) : hn::Add(load(-i), load(i));
        s0 = hn::MulAdd(hn::Set(d, kernels.s0[4 * v + u]), sum, s0);
        first = hn::MulAdd(hn::Set(d, kernels.first[4 * v + u]), sum, first);
        second = hn::MulAdd(hn::Set(d, kernels.second[4 * v + u]), sum, second);
      }
    }
    return StokesVector{hn::Add(s0, s0), hn::MulAdd(a1.At(x), first, hn::Mul(b1.At(x), second)),
                        hn::MulAdd(a2.At(x), first, hn::Mul(b2.At(x), second))};
  });
}

// Plain loops from here on: the compiler makes vectors of them for each instruction set.

void Above(const float* HWY_RESTRICT before, const float* HWY_RESTRICT here, int begin, int end,
           float* HWY_RESTRICT mean, float* HWY_RESTRICT edges) {
  for (int x = begin; x < end; ++x) {
    mean[x] = ((before[x - 1] + here[x - 1]) + 2 * (before[x] + here[x]) + (before[x + 1] + here[x + 1])) / 8;
    edges[x] = std::abs((before[x] - here[x]) -
                        0.5f * ((before[x - 1] - here[x - 1]) + (before[x + 1] - here[x + 1])));
  }
}

void Left(const float* HWY_RESTRICT up, const float* HWY_RESTRICT here, const float* HWY_RESTRICT down,
          int begin, int end, float* HWY_RESTRICT mean, float* HWY_RESTRICT edges) {
  for (int x = begin; x < end; ++x) {
    mean[x] = ((up[x - 1] + up[x]) + 2 * (here[x - 1] + here[x]) + (down[x - 1] + down[x])) / 8;
    edges[x] = std::abs((here[x - 1] - here[x]) - 0.5f * ((up[x - 1] - up[x]) + (down[x - 1] - down[x])));
  }
}

// out[x] = sum over 2 radius + 1 columns, of the sum over the rows.
void BoxSum(const float* const* rows, int count, int radius, int begin, int end, float* HWY_RESTRICT column,
            float* HWY_RESTRICT out) {
  if (count == 3) {
    const float *a = rows[0], *b = rows[1], *c = rows[2];
    for (int x = begin - radius; x < end + radius; ++x) column[x] = a[x] + b[x] + c[x];
  } else {
    const float *a = rows[0], *b = rows[1], *c = rows[2], *e = rows[3], *f = rows[4];
    for (int x = begin - radius; x < end + radius; ++x) column[x] = (a[x] + b[x]) + (c[x] + e[x]) + f[x];
  }
  if (radius == 1) {
    for (int x = begin; x < end; ++x) out[x] = column[x - 1] + column[x] + column[x + 1];
  } else {
    for (int x = begin; x < end; ++x)
      out[x] = ((column[x - 2] + column[x - 1]) + (column[x] + column[x + 1])) + column[x + 2];
  }
}

void GuideRow(const float* HWY_RESTRICT samples, const float* HWY_RESTRICT north,
              const float* HWY_RESTRICT south, const float* HWY_RESTRICT sides,
              const float* HWY_RESTRICT mean_north, const float* HWY_RESTRICT mean_south,
              const float* HWY_RESTRICT mean_sides, int begin, int end, float* HWY_RESTRICT guide,
              float* HWY_RESTRICT difference) {
  for (int x = begin; x < end; ++x) {
    const float n = 1 / (north[x] / 15 + 1e-4f), s = 1 / (south[x] / 15 + 1e-4f);
    const float w = 1 / (sides[x - 1] / 15 + 1e-4f), e = 1 / (sides[x + 2] / 15 + 1e-4f);
    guide[x] =
        (n * mean_north[x] + s * mean_south[x] + w * mean_sides[x] + e * mean_sides[x + 1]) / (n + s + w + e);
    difference[x] = samples[x] - guide[x];
  }
}

// Columns count from the row's beginning with its border.
void GuideRows(const Band& band, int first, int last, float* const* scratch, float* guide,
               float* difference) {
  const std::size_t stride = band.stride;
  const int left = kBorder - 2, right = kBorder + band.width + 2;  // of the guide
  const auto row = [&](float* plane, int r) { return plane + std::size_t(r) * stride; };
  float *above_mean = scratch[0], *above_edges = scratch[1], *left_mean = scratch[2],
        *left_edges = scratch[3];
  float *above_sums = scratch[4], *column = scratch[5];
  for (int r = first - 2; r < last + 3; ++r)
    Above(row(band.rows, r - 1), row(band.rows, r), left - 3, right + 3, row(above_mean, r),
          row(above_edges, r));
  for (int r = first - 2; r < last + 2; ++r)
    Left(row(band.rows, r - 1), row(band.rows, r), row(band.rows, r + 1), left - 3, right + 4,
         row(left_mean, r), row(left_edges, r));
  for (int r = first - 1; r < last + 2; ++r) {
    const float* rows[3] = {row(above_edges, r - 1), row(above_edges, r), row(above_edges, r + 1)};
    BoxSum(rows, 3, 2, left, right, column, row(above_sums, r));
  }
  float* side_sums = column + stride;
  for (int r = first; r < last; ++r) {
    const float* rows[5];
    for (int k = 0; k < 5; ++k) rows[k] = row(left_edges, r - 2 + k);
    BoxSum(rows, 5, 1, left - 1, right + 2, column, side_sums);
    GuideRow(row(band.rows, r), row(above_sums, r - 1), row(above_sums, r + 2), side_sums, row(above_mean, r),
             row(above_mean, r + 1), row(left_mean, r), left, right, row(guide, r), row(difference, r));
  }
}

}  // namespace polarscan::fused::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace polarscan::fused {

HWY_EXPORT(BilinearRow);
HWY_EXPORT(LinearRow);
HWY_EXPORT(GuideRows);

void BilinearRow(const float* above, const float* here, const float* below, const float* guide,
                 const StokesShares& shares, const OutRow& out) {
  HWY_DYNAMIC_DISPATCH(BilinearRow)(above, here, below, guide, shares, out);
}
void LinearRow(const float* const* rows, const LinearRowKernels& kernels, const OutRow& out) {
  HWY_DYNAMIC_DISPATCH(LinearRow)(rows, kernels, out);
}
void GuideRows(const Band& band, int first, int last, float* const* scratch, float* guide,
               float* difference) {
  HWY_DYNAMIC_DISPATCH(GuideRows)(band, first, last, scratch, guide, difference);
}

}  // namespace polarscan::fused
#endif
