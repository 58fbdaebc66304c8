// SPDX-License-Identifier: Apache-2.0
#include "demosaic/sensor/pixel_format.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "core/error.h"

namespace polarscan {
namespace {

constexpr int kLargestPictureSide = 1 << 20;
constexpr std::size_t kLargestStride = 1 << 24;

struct Family {
  const char *prefix, *bayer;
};
constexpr Family kFamilies[] = {
    {"Mono", ""}, {"BayerRG", "rggb"}, {"BayerGR", "grbg"}, {"BayerGB", "gbrg"}, {"BayerBG", "bggr"}};

// LUCID: PolarizeMono12p; FLIR: Polarized8, BayerRGPolarized12p; The Imaging Source: PolarizedMono12Packed,
// PolarizedBayerBG8.
std::string WithoutPolarized(std::string name) {
  for (const std::string word : {"Polarized", "Polarize"})
    if (const std::size_t at = name.find(word); at != std::string::npos) {
      name.erase(at, word.size());
      return name.empty() || std::isdigit(static_cast<unsigned char>(name[0])) ? "Mono" + name : name;
    }
  return name;
}

struct Depth {
  const char* suffix;
  int bits;
  Packing packing;
};
constexpr Depth kDepths[] = {
    {"8", 8, Packing::kBytes},       {"10", 10, Packing::kWords},        {"12", 12, Packing::kWords},
    {"14", 14, Packing::kWords},     {"16", 16, Packing::kWords},        {"10p", 10, Packing::kLsbFirst},
    {"12p", 12, Packing::kLsbFirst}, {"12Packed", 12, Packing::kGigE12}, {"10csi2p", 10, Packing::kMipi},
    {"12csi2p", 12, Packing::kMipi}, {"14csi2p", 14, Packing::kMipi}};

std::size_t BitsOnTheWire(const PixelFormat& format) {
  return format.packing == Packing::kWords ? 16u : std::size_t(format.bits);
}

// Of a MIPI format, which comes in whole groups: 4, 2 or 4 samples of 10, 12 or 14 bits.
std::size_t GroupSamples(int bits) { return bits == 12 ? 2 : 4; }

std::size_t BytesOf(const PixelFormat& format, std::size_t samples) {
  if (format.packing == Packing::kMipi) {
    const std::size_t group = GroupSamples(format.bits);
    samples = (samples + group - 1) / group * group;
  }
  return (samples * BitsOnTheWire(format) + 7) / 8;
}

std::uint16_t LsbFirst(const std::uint8_t* bytes, std::size_t sample, int bits) {
  const std::size_t bit = sample * std::size_t(bits), shift = bit % 8;
  const unsigned pair = bytes[bit / 8] | unsigned(bytes[bit / 8 + 1])
                                             << 8;  // 10 and 12 bits: two bytes suffice
  return std::uint16_t(pair >> shift & ((1u << bits) - 1));
}

std::uint16_t GigE12(const std::uint8_t* bytes, std::size_t sample) {
  const std::uint8_t* pair = bytes + sample / 2 * 3;
  return sample % 2 == 0 ? std::uint16_t(pair[0] << 4 | (pair[1] & 15))
                         : std::uint16_t(pair[2] << 4 | pair[1] >> 4);
}

// Where the parts of a sample lie in its group of bytes: its highest 8 bits, and the low ones, which may
// go on in the next byte.
struct MipiPlace {
  MipiPlace(std::size_t sample, int bits) {
    const std::size_t group = GroupSamples(bits), first = sample / group * (group * std::size_t(bits) / 8);
    const std::size_t bit = sample % group * std::size_t(bits - 8);
    high = first + sample % group;
    low = first + group + bit / 8;
    shift = int(bit % 8);
    mask = (1u << (bits - 8)) - 1;
    two_bytes = shift + bits - 8 > 8;
  }
  std::size_t high, low;
  int shift;
  unsigned mask;
  bool two_bytes;
};

std::uint16_t Mipi(const std::uint8_t* bytes, std::size_t sample, int bits) {
  const MipiPlace place(sample, bits);
  const unsigned low = bytes[place.low] | (place.two_bytes ? unsigned(bytes[place.low + 1]) << 8 : 0u);
  return std::uint16_t(unsigned(bytes[place.high]) << (bits - 8) | (low >> place.shift & place.mask));
}

// `count` samples from the first bit of `bytes` on.
void UnpackRun(const PixelFormat& format, const std::uint8_t* bytes, std::size_t first, std::size_t count,
               std::uint16_t* samples) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = first + i;
    switch (format.packing) {
      case Packing::kBytes:
        samples[i] = bytes[at];
        break;
      case Packing::kWords:
        samples[i] = std::uint16_t(bytes[2 * at] | bytes[2 * at + 1] << 8);
        break;
      case Packing::kLsbFirst:
        samples[i] = LsbFirst(bytes, at, format.bits);
        break;
      case Packing::kGigE12:
        samples[i] = GigE12(bytes, at);
        break;
      case Packing::kMipi:
        samples[i] = Mipi(bytes, at, format.bits);
        break;
    }
  }
}

void PackSample(const PixelFormat& format, std::size_t at, unsigned value, std::uint8_t* bytes) {
  switch (format.packing) {
    case Packing::kBytes:
      bytes[at] = std::uint8_t(value);
      break;
    case Packing::kWords:
      bytes[2 * at] = std::uint8_t(value);
      bytes[2 * at + 1] = std::uint8_t(value >> 8);
      break;
    case Packing::kLsbFirst: {
      const std::size_t bit = at * std::size_t(format.bits);
      const unsigned shifted = value << bit % 8;
      bytes[bit / 8] |= std::uint8_t(shifted);
      bytes[bit / 8 + 1] |= std::uint8_t(shifted >> 8);
      break;
    }
    case Packing::kGigE12: {
      std::uint8_t* pair = bytes + at / 2 * 3;
      pair[at % 2 * 2] = std::uint8_t(value >> 4);
      pair[1] |= std::uint8_t((value & 15) << (at % 2 * 4));
      break;
    }
    case Packing::kMipi: {
      const MipiPlace place(at, format.bits);
      bytes[place.high] = std::uint8_t(value >> (format.bits - 8));
      const unsigned low = (value & place.mask) << place.shift;
      bytes[place.low] |= std::uint8_t(low);
      if (place.two_bytes) bytes[place.low + 1] |= std::uint8_t(low >> 8);
      break;
    }
  }
}

}  // namespace

std::optional<PixelFormat> FindPixelFormat(const std::string& name) {
  const std::string plain = WithoutPolarized(name);
  for (const Family& family : kFamilies)
    for (const Depth& depth : kDepths)
      if (plain == std::string(family.prefix) + depth.suffix)
        return PixelFormat{name, depth.bits, depth.packing, family.bayer};
  return std::nullopt;
}

PixelFormat ParsePixelFormat(const std::string& name) {
  if (const auto format = FindPixelFormat(name)) return *format;
  throw Error("this pixel format is not a raw mosaic that can be read", name.empty() ? "(none)" : name,
              "Set the camera to Mono or Bayer with 8, 10, 12, 14, 16, 10p, 12p, 12Packed or 10csi2p to "
              "14csi2p, as in Mono12p");
}

std::size_t RowBytes(const PixelFormat& format, int width) { return BytesOf(format, std::size_t(width)); }

std::size_t PayloadBytes(const PixelFormat& format, int width, int height, std::size_t stride) {
  if (height == 0) return 0;
  if (stride == 0) return BytesOf(format, std::size_t(width) * std::size_t(height));
  return stride * std::size_t(height - 1) + RowBytes(format, width);
}

Image<std::uint16_t> Unpack(const PixelFormat& format, std::span<const std::uint8_t> payload, int width,
                            int height, std::size_t stride) {
  if (width <= 0 || height <= 0 || std::max(width, height) > kLargestPictureSide || stride > kLargestStride)
    throw Error(fmt::format("a frame cannot have {}x{} px in rows of {} bytes", width, height, stride),
                format.name);
  const std::size_t needed = PayloadBytes(format, width, height, stride), row = std::size_t(width);
  if (payload.size() < needed || (stride > 0 && stride < RowBytes(format, width)))
    throw Error(fmt::format("a {}x{} frame with rows of {} bytes does not fit in its {} bytes", width, height,
                            stride, payload.size()),
                format.name);
  std::vector<std::uint8_t> bytes(payload.begin(), payload.begin() + std::ptrdiff_t(needed));
  bytes.resize(needed + 2);  // whole groups may be read at the end
  Image<std::uint16_t> samples(width, height);
  for (std::size_t y = 0; y < std::size_t(height); ++y)
    UnpackRun(format, bytes.data() + y * stride, stride ? 0 : y * row, row, samples.row(int(y)));
  return samples;
}

std::vector<std::uint16_t> UnpackSamples(const PixelFormat& format, std::span<const std::uint8_t> payload,
                                         std::size_t first, std::size_t count) {
  if (BytesOf(format, first + count) > payload.size())
    throw Error(fmt::format("sample {} does not fit in {} bytes", first + count, payload.size()),
                format.name);
  // 210 bytes are a whole number of groups in every format.
  const std::size_t begin = first * BitsOnTheWire(format) / 1680 * 210,
                    skipped = begin * 8 / BitsOnTheWire(format);
  std::vector<std::uint8_t> bytes(payload.begin() + std::ptrdiff_t(begin),
                                  payload.begin() + std::ptrdiff_t(BytesOf(format, first + count)));
  bytes.resize(bytes.size() + 2);  // whole groups may be read at the end
  std::vector<std::uint16_t> samples(count);
  UnpackRun(format, bytes.data(), first - skipped, count, samples.data());
  return samples;
}

std::vector<std::uint8_t> Pack(const PixelFormat& format, const Image<std::uint16_t>& samples) {
  const std::size_t size = BytesOf(format, samples.size());
  std::vector<std::uint8_t> bytes(size + 2);
  const unsigned mask = (1u << format.bits) - 1;
  for (std::size_t i = 0; i < samples.size(); ++i)
    PackSample(format, i, samples.pixels()[i] & mask, bytes.data());
  bytes.resize(size);
  return bytes;
}

}  // namespace polarscan
