// SPDX-License-Identifier: Apache-2.0
// The siblings of AopSystemScalar and AopEnergyScalar for vectors of any width (see ncc_simd.cpp).
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stereo/costs/normal_from_aop_simd.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

#include "stereo/costs/normal_from_aop.h"

HWY_BEFORE_NAMESPACE();
namespace polarscan::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using AopFloats = hn::CappedTag<float, AopTable::kBlock>;
using V = hn::Vec<AopFloats>;

struct AopVectors {
  V m[3], o[3], share, length;  // m: of the vector that fits
};

inline AopVectors LoadAop(const AopTable& t, int i, const V (&n)[3]) {
  const AopFloats d;
  AopVectors v;
  V diffuse[3], specular[3];
  for (int k = 0; k < 3; ++k)
    diffuse[k] = hn::Load(d, t.diffuse[k] + i), specular[k] = hn::Load(d, t.specular[k] + i);
  const auto dot = [&](const V(&a)[3]) {
    return hn::MulAdd(a[0], n[0], hn::MulAdd(a[1], n[1], hn::Mul(a[2], n[2])));
  };
  const V dd = dot(diffuse), ss = dot(specular), d2 = hn::Mul(dd, dd), s2 = hn::Mul(ss, ss);
  const auto is_diffuse = hn::Lt(d2, s2);
  v.length = hn::Add(hn::Add(d2, s2), hn::Set(d, AopTable::kLeastTilt));
  v.share = hn::Div(hn::Min(d2, s2), v.length);
  for (int k = 0; k < 3; ++k) {
    v.m[k] = hn::IfThenElse(is_diffuse, diffuse[k], specular[k]);
    v.o[k] = hn::IfThenElse(is_diffuse, specular[k], diffuse[k]);
  }
  return v;
}

void AopSystem(const AopTable& t, const float* normal, float softness, float* sums) {
  const AopFloats d;
  const V n[3] = {hn::Set(d, normal[0]), hn::Set(d, normal[1]), hn::Set(d, normal[2])};
  const V one = hn::Set(d, 1.0f), sharp = hn::Set(d, 1 / softness);
  V sum[6] = {hn::Zero(d), hn::Zero(d), hn::Zero(d), hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  for (int i = 0; i < t.padded; i += int(hn::Lanes(d))) {
    const AopVectors v = LoadAop(t, i, n);
    const V weight = hn::Div(hn::Load(d, t.weight + i), hn::Mul(hn::MulAdd(v.share, sharp, one), v.length));
    const V along = hn::Mul(weight, hn::Sub(one, v.share)), away = hn::Mul(weight, v.share);
    int at = 0;
    for (int a = 0; a < 3; ++a)
      for (int b = a; b < 3; ++b, ++at)
        sum[at] = hn::Add(sum[at], hn::Sub(hn::Mul(along, hn::Mul(v.m[a], v.m[b])),
                                           hn::Mul(away, hn::Mul(v.o[a], v.o[b]))));
  }
  for (int k = 0; k < 6; ++k) sums[k] = hn::GetLane(hn::SumOfLanes(d, sum[k]));
}

float AopEnergy(const AopTable& t, const float* normal, float softness) {
  const AopFloats d;
  const V n[3] = {hn::Set(d, normal[0]), hn::Set(d, normal[1]), hn::Set(d, normal[2])};
  V sum = hn::Zero(d);
  for (int i = 0; i < t.padded; i += int(hn::Lanes(d))) {
    const AopVectors v = LoadAop(t, i, n);
    sum = hn::Add(
        sum, hn::Div(hn::Mul(hn::Load(d, t.weight + i), v.share), hn::Add(v.share, hn::Set(d, softness))));
  }
  return hn::GetLane(hn::SumOfLanes(d, sum));
}

}  // namespace polarscan::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace polarscan {

HWY_EXPORT(AopSystem);
HWY_EXPORT(AopEnergy);

Eigen::Matrix3f AopSystemSimd(const AopTable& table, const Eigen::Vector3f& normal, float softness) {
  float s[6];
  HWY_DYNAMIC_DISPATCH(AopSystem)(table, normal.data(), softness, s);
  return Eigen::Matrix3f{{s[0], s[1], s[2]}, {s[1], s[3], s[4]}, {s[2], s[4], s[5]}};
}

float AopEnergySimd(const AopTable& table, const Eigen::Vector3f& normal, float softness) {
  return HWY_DYNAMIC_DISPATCH(AopEnergy)(table, normal.data(), softness);
}

}  // namespace polarscan
#endif
