// SPDX-License-Identifier: Apache-2.0
// Samples of every packing to light (fused_rows.h). Compiled once per instruction set, as fused_rows.cpp is.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "demosaic/fused/unpack_rows.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

#include <cstring>

#include "demosaic/fused/fused_rows.h"

HWY_BEFORE_NAMESPACE();
namespace polarscan::fused::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using V = hn::Vec<Floats>;

#if HWY_TARGET != HWY_SCALAR
// Two samples in three bytes: each 16 bytes of a vector get the next 12 of the row, which are 8 samples. As
// many whole vectors as there are; returns how many samples those were.
template <bool kLsbFirst, class Bytes>
int Unpack12Vectors(Bytes bytes, const std::uint8_t* row, const std::uint8_t* end, int width,
                    const Light& light, float* out) {
  const hn::Repartition<std::uint16_t, Bytes> words;
  const hn::Repartition<std::uint32_t, Bytes> quads;
  const hn::Half<decltype(words)> half;
  const hn::Rebind<std::int32_t, decltype(half)> ints;
  const hn::Rebind<float, decltype(half)> floats;
  const std::size_t size = hn::Lanes(bytes);
  const int count = int(size / 2);  // samples
  // The two bytes that hold each sample; in 12Packed the first one of an even sample is the high one.
  HWY_ALIGN constexpr std::uint8_t kPlaces[2][16] = {{1, 0, 1, 2, 4, 3, 4, 5, 7, 6, 7, 8, 10, 9, 10, 11},
                                                     {0, 1, 1, 2, 3, 4, 4, 5, 6, 7, 7, 8, 9, 10, 10, 11}};
  HWY_ALIGN constexpr std::int32_t kSpread[16] = {0, 1, 2, 2, 3, 4, 5, 5, 6, 7, 8, 8, 9, 10, 11, 11};
  const auto places = hn::LoadDup128(bytes, kPlaces[kLsbFirst ? 1 : 0]);
  const auto spread = hn::SetTableIndices(quads, kSpread);
  const auto scale = hn::Set(floats, light.scale), zero = hn::Set(floats, -light.black * light.scale);
  int x = 0;
  for (; x + count <= width && row + size <= end; x += count, row += size / 4 * 3) {
    const auto apart = hn::TableLookupLanes(hn::BitCast(quads, hn::LoadU(bytes, row)), spread);
    const auto pairs = hn::BitCast(words, hn::TableLookupBytes(hn::BitCast(bytes, apart), places));
    const auto odd = hn::ShiftRight<4>(pairs);
    const auto even = kLsbFirst
                          ? hn::And(pairs, hn::Set(words, 0xFFF))
                          : hn::Or(hn::And(odd, hn::Set(words, 0xFF0)), hn::And(pairs, hn::Set(words, 15)));
    const auto samples = hn::OddEven(odd, even);
    const auto light_of = [&](auto part) HWY_ATTR {
      return hn::MulAdd(hn::ConvertTo(floats, hn::PromoteTo(ints, part)), scale, zero);
    };
    hn::StoreU(light_of(hn::LowerHalf(half, samples)), floats, out + x);
    hn::StoreU(light_of(hn::UpperHalf(half, samples)), floats, out + x + count / 2);
  }
  return x;
}
#endif

// Samples of one or two whole bytes.
template <class Sample>
void UnpackWhole(const std::uint8_t* row, int width, const Light& light, float* HWY_RESTRICT out) {
  int x = 0;
#if HWY_TARGET != HWY_SCALAR
  const Floats d;
  const hn::Rebind<std::int32_t, Floats> ints;
  const hn::Rebind<Sample, Floats> samples;
  const hn::Repartition<std::uint8_t, decltype(samples)> bytes;
  const V scale = hn::Set(d, light.scale), zero = hn::Set(d, -light.black * light.scale);
  for (const int lanes = int(hn::Lanes(d)); x + lanes <= width; x += lanes) {
    const auto counts = hn::BitCast(samples, hn::LoadU(bytes, row + std::size_t(x) * sizeof(Sample)));
    hn::StoreU(hn::MulAdd(hn::ConvertTo(d, hn::PromoteTo(ints, counts)), scale, zero), d, out + x);
  }
#endif
  for (; x < width; ++x) {
    Sample sample;
    std::memcpy(&sample, row + std::size_t(x) * sizeof(Sample), sizeof(Sample));
    out[x] = (float(int(sample)) - light.black) * light.scale;
  }
}

template <bool kLsbFirst>
void Unpack12(const std::uint8_t* row, const std::uint8_t* end, int width, const Light& light, float* out) {
  int x = 0;
#if HWY_TARGET != HWY_SCALAR
  x = Unpack12Vectors<kLsbFirst>(hn::CappedTag<std::uint8_t, 64>(), row, end, width, light, out);
  x += Unpack12Vectors<kLsbFirst>(hn::FixedTag<std::uint8_t, 16>(), row + x / 2 * 3, end, width - x, light,
                                  out + x);
  row += x / 2 * 3;
#endif
  (void)end;
  for (; x < width; x += 2, row += 3) {
    const unsigned a = kLsbFirst ? row[0] | (row[1] & 15u) << 8 : unsigned(row[0]) << 4 | (row[1] & 15u);
    out[x] = (float(a) - light.black) * light.scale;
    if (x + 1 == width) break;
    const unsigned b = unsigned(row[2]) << 4 | row[1] >> 4;
    out[x + 1] = (float(b) - light.black) * light.scale;
  }
}

void UnpackRow(Packing packing, int bits, const std::uint8_t* row, const std::uint8_t* end, int width,
               const Light& light, float* HWY_RESTRICT out) {
  switch (packing) {
    case Packing::kMipi:  // left to UnpackSamples
      return;
    case Packing::kBytes:
      return UnpackWhole<std::uint8_t>(row, width, light, out);
    case Packing::kWords:
      return UnpackWhole<std::uint16_t>(row, width, light, out);
    case Packing::kGigE12:
      return Unpack12<false>(row, end, width, light, out);
    case Packing::kLsbFirst:
      if (bits == 12) return Unpack12<true>(row, end, width, light, out);
      for (int x = 0; x < width; ++x) {  // 10p
        const int bit = 10 * x;
        const unsigned pair = row[bit / 8] | unsigned(row[bit / 8 + 1]) << 8;
        out[x] = (float(pair >> bit % 8 & 1023u) - light.black) * light.scale;
      }
  }
}

}  // namespace polarscan::fused::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace polarscan::fused {

HWY_EXPORT(UnpackRow);

void UnpackRow(Packing packing, int bits, const std::uint8_t* row, const std::uint8_t* end, int width,
               const Light& light, float* out) {
  HWY_DYNAMIC_DISPATCH(UnpackRow)(packing, bits, row, end, width, light, out);
}

}  // namespace polarscan::fused
#endif
