// SPDX-License-Identifier: Apache-2.0
// For vectors of any width: compiled once per instruction set and chosen at run time (see ncc_simd.cpp).
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stereo/rounds/band_rows.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

#include <algorithm>

#include "stereo/rounds/band_rows.h"

HWY_BEFORE_NAMESPACE();
namespace polarscan::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using RowFloats = hn::CappedTag<float, BandPlane::kMargin>;

// Along a row: out = sum of taps[|dx|] a b.
void FilterRow(const float* a, const float* b, std::span<const float> taps, int count, float* out) {
  const RowFloats d;
  for (int i = 0; i < count; i += int(hn::Lanes(d))) {
    const auto product = [&](int at) { return hn::Mul(hn::LoadU(d, a + at), hn::LoadU(d, b + at)); };
    auto sum = hn::Mul(hn::Set(d, taps[0]), product(i));
    for (int k = 1; k < int(taps.size()); ++k)
      sum = hn::MulAdd(hn::Set(d, taps[std::size_t(k)]), hn::Add(product(i - k), product(i + k)), sum);
    hn::StoreU(sum, d, out + i);
  }
}

void WindowSumsSimd(const BandPlane& a, const BandPlane& b, std::span<const float> taps, int begin, int end,
                    BandPlane& scratch, BandPlane& out) {
  const RowFloats d;
  const int reach = int(taps.size()) - 1;
  for (int y = std::max(a.top(), begin - reach); y < std::min(a.bottom(), end + reach); ++y)
    FilterRow(a.Row(y), b.Row(y), taps, a.width(), scratch.Row(y));
  for (int y = begin; y < end; ++y)
    for (int i = 0; i < a.width(); i += int(hn::Lanes(d))) {
      auto sum = hn::Zero(d);
      for (int k = std::max(-reach, a.top() - y); k <= std::min(reach, a.bottom() - 1 - y); ++k)
        sum =
            hn::MulAdd(hn::Set(d, taps[std::size_t(std::abs(k))]), hn::LoadU(d, scratch.Row(y + k) + i), sum);
      hn::StoreU(sum, d, out.Row(y) + i);
    }
}

void DrawRowSimd(const Image<float>& picture, const RowCamera& c, float scale, const float* x, const float* y,
                 const float* z, const float* seen, int count, float* out) {
  const RowFloats d;
  const hn::RebindToSigned<RowFloats> di;
  const auto zero = hn::Zero(d), half = hn::Set(d, 0.5f), s = hn::Set(d, scale);
  const auto last_x = hn::Set(d, float(picture.width()) - 1.001f),
             last_y = hn::Set(d, float(picture.height()) - 1.001f);
  const float* pixels = picture.pixels().data();
  const float* below = pixels + picture.width();
  for (int i = 0; i < count; i += int(hn::Lanes(d))) {
    const auto pz = hn::Max(hn::MulAdd(s, hn::LoadU(d, z + i), hn::Set(d, c.tz)), hn::Set(d, 1e-6f));
    const auto inverse = hn::Div(hn::Set(d, 1.0f), pz);
    const auto px = hn::MulAdd(s, hn::LoadU(d, x + i), hn::Set(d, c.tx)),
               py = hn::MulAdd(s, hn::LoadU(d, y + i), hn::Set(d, c.ty));
    const auto centre_u = hn::Set(d, c.cx - 0.5f), centre_v = hn::Set(d, c.cy - 0.5f);
    const auto u = hn::MulAdd(hn::Mul(hn::Set(d, c.fx), px), inverse, centre_u),
               v = hn::MulAdd(hn::Mul(hn::Set(d, c.fy), py), inverse, centre_v);
    // What is not seen lies anywhere; it is read inside of the picture, and thrown away.
    const auto inside_u = hn::Min(hn::Max(u, zero), last_x), inside_v = hn::Min(hn::Max(v, zero), last_y);
    const auto iu = hn::ConvertTo(di, inside_u), iv = hn::ConvertTo(di, inside_v);
    const auto au = hn::Sub(inside_u, hn::ConvertTo(d, iu)), av = hn::Sub(inside_v, hn::ConvertTo(d, iv));
    const auto at = hn::Add(hn::Mul(iv, hn::Set(di, picture.width())), iu);
    const auto p00 = hn::GatherIndex(d, pixels, at), p10 = hn::GatherIndex(d, pixels + 1, at),
               p01 = hn::GatherIndex(d, below, at), p11 = hn::GatherIndex(d, below + 1, at);
    const auto upper = hn::MulAdd(au, hn::Sub(p10, p00), p00), lower = hn::MulAdd(au, hn::Sub(p11, p01), p01);
    const auto value = hn::Sub(hn::MulAdd(av, hn::Sub(lower, upper), upper), half);
    hn::StoreU(hn::IfThenElse(hn::Gt(hn::LoadU(d, seen + i), zero), value, zero), d, out + i);
  }
}

void MatchingCostRowSimd(const RowSums& sums, float epsilon, int count, float* out) {
  const RowFloats d;
  const auto extra = hn::Set(d, epsilon), one = hn::Set(d, 1.0f);
  for (int i = 0; i < count; i += int(hn::Lanes(d))) {
    const auto inverse = hn::Div(one, hn::Max(hn::LoadU(d, sums.w + i), hn::Set(d, 1e-6f)));
    const auto mean_r = hn::Mul(hn::LoadU(d, sums.r + i), inverse),
               mean_s = hn::Mul(hn::LoadU(d, sums.s + i), inverse);
    const auto moment = [&](const float* sum, auto product) {
      return hn::Add(hn::Sub(hn::Mul(hn::LoadU(d, sum + i), inverse), product), extra);
    };
    const auto var_r = moment(sums.rr, hn::Mul(mean_r, mean_r)),
               var_s = moment(sums.ss, hn::Mul(mean_s, mean_s));
    const auto covariance = moment(sums.rs, hn::Mul(mean_r, mean_s));
    const auto product = hn::Max(hn::Mul(var_r, var_s), hn::Set(d, 1e-16f));
    hn::StoreU(hn::Sub(one, hn::Div(covariance, hn::Sqrt(product))), d, out + i);
  }
}

}  // namespace polarscan::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace polarscan {

HWY_EXPORT(WindowSumsSimd);
HWY_EXPORT(DrawRowSimd);
HWY_EXPORT(MatchingCostRowSimd);

void WindowSums(const BandPlane& a, const BandPlane& b, std::span<const float> taps, int begin, int end,
                BandPlane& scratch, BandPlane& out) {
  HWY_DYNAMIC_DISPATCH(WindowSumsSimd)(a, b, taps, begin, end, scratch, out);
}

void DrawRow(const Image<float>& picture, const RowCamera& camera, float scale, const float* x,
             const float* y, const float* z, const float* seen, int count, float* out) {
  HWY_DYNAMIC_DISPATCH(DrawRowSimd)(picture, camera, scale, x, y, z, seen, count, out);
}

void MatchingCostRow(const RowSums& sums, float epsilon, int count, float* out) {
  HWY_DYNAMIC_DISPATCH(MatchingCostRowSimd)(sums, epsilon, count, out);
}

}  // namespace polarscan
#endif
