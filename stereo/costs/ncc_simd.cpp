// SPDX-License-Identifier: Apache-2.0
// The sibling of NccCostScalar for vectors of any width, compiled once per instruction set by Highway
// (foreach_target.h includes this file again for each) and chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stereo/costs/ncc_simd.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

#include "stereo/costs/ncc.h"

HWY_BEFORE_NAMESPACE();
namespace polarscan::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Blocks of at most 16 floats, so that padding to 16 fits every target.
using Floats = hn::CappedTag<float, 16>;
using Words = hn::RebindToUnsigned<Floats>;
using Ints = hn::RebindToSigned<Floats>;

template <class V>
V LowPixel(V words) {
  return hn::And(words, hn::Set(Words(), 0xFFFF));
}

// Linear interpolation inside a word's two pixels, in units of 1/65535.
template <class W, class F>
F Interpolate(W words, F fraction) {
  const Floats d;
  const auto low = hn::ConvertTo(d, hn::BitCast(Ints(), LowPixel(words)));
  const auto high = hn::ConvertTo(d, hn::BitCast(Ints(), hn::ShiftRight<16>(words)));
  return hn::MulAdd(fraction, hn::Sub(high, low), low);
}

float NccCost(const Window& window, const Patch& patch, const Warp& h, const PackedImage& source,
              const Contrast& contrast) {
  const float cu = h.u0 / h.w0, cv = h.v0 / h.w0;
  if (!(h.w0 > 0 && cu >= 0 && cv >= 0 && cu <= float(source.width) && cv <= float(source.height))) return 2;
  const Floats d;
  const Ints di;
  const auto zero = hn::Zero(d), half = hn::Set(d, 0.5f);
  const auto max_x = hn::Set(d, float(source.width) - 1.001f),
             max_y = hn::Set(d, float(source.height) - 1.001f);
  const auto center = hn::Set(d, patch.center), unit = hn::Set(d, 1 / 65535.0f);
  const auto stride = hn::Set(di, source.width);
  const std::uint32_t* words = source.words.data();
  auto sum_s = zero, sum_ss = zero, sum_rs = zero, nearest = hn::Set(d, h.w0);
  for (int i = 0; i < window.padded; i += int(hn::Lanes(d))) {
    const auto dx = hn::Load(d, window.dx + i), dy = hn::Load(d, window.dy + i);
    const auto w = hn::MulAdd(hn::Set(d, h.wx), dx, hn::MulAdd(hn::Set(d, h.wy), dy, hn::Set(d, h.w0)));
    nearest = hn::Min(nearest, w);
    const auto inverse = hn::Div(hn::Set(d, 1.0f), hn::Max(w, hn::Set(d, 1e-6f)));
    const auto nu = hn::MulAdd(hn::Set(d, h.ux), dx, hn::MulAdd(hn::Set(d, h.uy), dy, hn::Set(d, h.u0)));
    const auto nv = hn::MulAdd(hn::Set(d, h.vx), dx, hn::MulAdd(hn::Set(d, h.vy), dy, hn::Set(d, h.v0)));
    const auto u = hn::Min(hn::Max(hn::Sub(hn::Mul(nu, inverse), half), zero), max_x);
    const auto v = hn::Min(hn::Max(hn::Sub(hn::Mul(nv, inverse), half), zero), max_y);
    const auto iu = hn::ConvertTo(di, u), iv = hn::ConvertTo(di, v);
    const auto index = hn::Add(hn::Mul(iv, stride), iu);
    const auto fu = hn::Sub(u, hn::ConvertTo(d, iu)), fv = hn::Sub(v, hn::ConvertTo(d, iv));
    const auto top = Interpolate(hn::GatherIndex(Words(), words, index), fu);
    const auto bottom = Interpolate(hn::GatherIndex(Words(), words, hn::Add(index, stride)), fu);
    const auto s = hn::MulSub(hn::MulAdd(fv, hn::Sub(bottom, top), top), unit, center);
    const auto weighted = hn::Mul(hn::Load(d, patch.weight + i), s);
    sum_s = hn::Add(sum_s, weighted);
    sum_ss = hn::MulAdd(weighted, s, sum_ss);
    sum_rs = hn::MulAdd(hn::Load(d, patch.weighted + i), s, sum_rs);
  }
  if (hn::GetLane(hn::MinOfLanes(d, nearest)) <= 0) return 2;
  const float s = hn::GetLane(hn::SumOfLanes(d, sum_s));
  const float variance = std::max(0.0f, hn::GetLane(hn::SumOfLanes(d, sum_ss)) - s * s);
  const float covariance = hn::GetLane(hn::SumOfLanes(d, sum_rs)) - patch.mean * s;
  return NccCostOf(patch.variance, variance, covariance, contrast);
}

}  // namespace polarscan::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace polarscan {

HWY_EXPORT(NccCost);

float NccCostSimd(const Window& window, const Patch& patch, const Warp& warp, const PackedImage& source,
                  const Contrast& contrast) {
  return HWY_DYNAMIC_DISPATCH(NccCost)(window, patch, warp, source, contrast);
}

}  // namespace polarscan
#endif
