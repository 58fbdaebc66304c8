// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "acquisition/camera/frame.h"

namespace polarscan {

// One record of a segment: a header of 256 bytes, little-endian, and the payload (docs/session.md has the
// table). Each describes itself, so a segment is read by going from record to record, and after damage by
// searching for the next header that is whole.
struct Record {
  enum class Type : std::uint32_t { kFrame = 0, kMissing = 1 };
  Type type = Type::kFrame;
  std::uint64_t session = 0;  // the session's id: old bytes on the disk are not taken for records
  std::uint64_t index = 0;    // 0, 1, 2, ... through all segments: a gap means lost records
  FrameInfo info;             // kMissing: sequence is the first missing frame's, name the reason
  std::uint64_t missing = 0;  // frames that a kMissing record stands for
  std::uint64_t payload_bytes = 0, payload_hash = 0;  // XXH3, 64 bits
};

constexpr std::size_t kRecordHeaderBytes = 256;
constexpr std::string_view kRecordMagic = "PSCRECRD";

// Throws Error if a text does not fit.
std::string EncodeHeader(const Record& record);

// Nothing if the bytes (256 or more) do not start with a whole header. Never throws.
std::optional<Record> DecodeHeader(std::string_view bytes);

}  // namespace polarscan
