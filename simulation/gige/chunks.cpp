// SPDX-License-Identifier: Apache-2.0
#include "simulation/gige/chunks.h"

#include <bit>
#include <cmath>

#include "simulation/gige/registers.h"

namespace polarscan {
namespace {

constexpr std::size_t kChunkBytes = 8, kChunkTagBytes = 8;

}  // namespace

Bytes WithChunks(const Frame& frame, const gvsp::Image& image, const std::set<std::uint32_t>& ids) {
  Bytes payload = frame.payload;
  gvsp::PutChunkTag(payload, 0, payload.size());
  const auto put = [&](std::uint32_t id, std::uint64_t value) {
    if (ids.count(id) == 0) return;
    PutBig<std::uint64_t>(payload, value);
    gvsp::PutChunkTag(payload, id, kChunkBytes);
  };
  const auto put_float = [&](std::uint32_t id, double value) {
    if (!std::isnan(value)) put(id, std::bit_cast<std::uint64_t>(value));
  };
  put(kGigeChunks[0].id, image.timestamp);
  put(kGigeChunks[1].id, image.block);
  put_float(kGigeChunks[2].id, frame.info.exposure_us);
  put_float(kGigeChunks[3].id, frame.info.gain_db);
  return payload;
}

std::size_t BytesOfChunks(std::size_t count) {
  return kChunkTagBytes + count * (kChunkBytes + kChunkTagBytes);
}

}  // namespace polarscan
