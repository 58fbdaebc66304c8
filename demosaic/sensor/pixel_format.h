// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/image.h"

namespace polarscan {

// How samples lie in the bytes that a camera sends (GenICam PFNC 2.4, GigE Vision 2.0).
enum class Packing {
  kBytes,     // one byte a sample
  kWords,     // 16 bits a sample, little-endian, value in the low bits
  kLsbFirst,  // "p": a stream of bits, each sample's lowest bit first; 10p: 4 samples in 5 bytes, 12p: 2 in 3
  kGigE12,    // "12Packed": bytes a[11:4], b[3:0] a[3:0], b[11:4]
  kMipi,      // "csi2p" (MIPI CSI-2, V4L2's Y10P ...): each sample's highest 8 bits, then the low bits of the
              // group, lowest first; 10: 4 samples in 5 bytes, 12: 2 in 3, 14: 4 in 7
};

// A raw mosaic's pixel format. Recognised by its name, never by its 32-bit code: vendors' codes collide.
struct PixelFormat {
  std::string name;  // "Mono12p", "BayerRG8", "PolarizeMono12Packed"
  int bits = 8;      // of a sample
  Packing packing = Packing::kBytes;
  std::string bayer;  // "rggb", "grbg", "gbrg", "bggr" for BayerRG, GR, GB, BG; empty for mono
};

// Nothing if the name is none of (Mono | BayerRG | BayerGR | BayerGB | BayerBG) followed by one of 8, 10, 12,
// 14, 16, 10p, 12p, 12Packed, 10csi2p, 12csi2p, 14csi2p (libcamera's suffix; PFNC has no name for these),
// with or without the vendors' Polarize, Polarized in it (Polarized alone is mono).
std::optional<PixelFormat> FindPixelFormat(const std::string& name);
// The same. Throws Error naming the formats there are.
PixelFormat ParsePixelFormat(const std::string& name);

// Bytes of a row without padding, rounded up; of a picture whose rows take `stride` bytes (0: rows follow
// each other without padding, in packed formats even within a byte).
std::size_t RowBytes(const PixelFormat& format, int width);
std::size_t PayloadBytes(const PixelFormat& format, int width, int height, std::size_t stride = 0);

// The samples of a payload; what follows the picture is not looked at. Throws Error if the payload is too
// short, the stride shorter than a row, or a side not in 1 ... 2^20.
Image<std::uint16_t> Unpack(const PixelFormat& format, std::span<const std::uint8_t> payload, int width,
                            int height, std::size_t stride = 0);

// `count` samples from number `first` on, of a picture without padding. Throws Error if there are not so
// many.
std::vector<std::uint16_t> UnpackSamples(const PixelFormat& format, std::span<const std::uint8_t> payload,
                                         std::size_t first, std::size_t count);

// The other way, without padding; bits above the format's are cut off.
std::vector<std::uint8_t> Pack(const PixelFormat& format, const Image<std::uint16_t>& samples);

}  // namespace polarscan
