// SPDX-License-Identifier: Apache-2.0
#include "acquisition/session/record.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>

#include "core/error.h"
#include "core/files/files.h"

namespace polarscan {
namespace {

static_assert(std::endian::native == std::endian::little, "the session format is little-endian");

constexpr std::uint32_t kRecordVersion = 1;
constexpr int kLargestSide = 1 << 20;

struct Header {
  char magic[8];
  std::uint32_t version, type;
  std::uint64_t session, index, sequence;
  std::int64_t camera_time_ns, host_time_ns;
  std::uint32_t width, height, stride, reserved;
  double exposure_us, gain_db, temperature_c;
  std::uint64_t shot;
  char pixel_format[48], name[64];
  std::uint64_t payload_bytes, payload_hash, missing, reserved2, header_hash;
};
static_assert(sizeof(Header) == kRecordHeaderBytes && offsetof(Header, header_hash) == 248);

template <std::size_t N>
void CopyText(const std::string& text, char (&out)[N]) {
  if (text.size() >= N)
    throw Error("this text is too long for a session's record", text, "Use a shorter name");
  std::memcpy(out, text.data(), text.size());
}

template <std::size_t N>
std::string TextOf(const char (&text)[N]) {
  return {text, std::find(text, text + N, '\0')};
}

std::string_view BytesOf(const Header& header) {
  return {reinterpret_cast<const char*>(&header), sizeof header};
}

std::uint64_t HashOf(const Header& header) {
  return Hash(BytesOf(header).substr(0, offsetof(Header, header_hash)));
}

FrameInfo InfoOf(const Header& h) {
  return {h.sequence,   h.camera_time_ns, h.host_time_ns, TextOf(h.pixel_format),
          int(h.width), int(h.height),    int(h.stride),  h.exposure_us,
          h.gain_db,    h.temperature_c,  h.shot,         TextOf(h.name)};
}

}  // namespace

std::string EncodeHeader(const Record& record) {
  Header h{};
  const FrameInfo& info = record.info;
  std::memcpy(h.magic, kRecordMagic.data(), sizeof h.magic);
  h.version = kRecordVersion, h.type = std::uint32_t(record.type);
  h.session = record.session, h.index = record.index, h.sequence = info.sequence;
  h.camera_time_ns = info.camera_time_ns, h.host_time_ns = info.host_time_ns;
  h.width = std::uint32_t(info.width), h.height = std::uint32_t(info.height),
  h.stride = std::uint32_t(info.stride);
  h.exposure_us = info.exposure_us, h.gain_db = info.gain_db, h.temperature_c = info.temperature_c;
  h.shot = info.shot;
  CopyText(info.pixel_format, h.pixel_format);
  CopyText(info.name, h.name);
  h.payload_bytes = record.payload_bytes, h.payload_hash = record.payload_hash, h.missing = record.missing;
  h.header_hash = HashOf(h);
  return std::string(BytesOf(h));
}

std::optional<Record> DecodeHeader(std::string_view bytes) {
  Header h;
  if (bytes.size() < sizeof h || !bytes.starts_with(kRecordMagic)) return std::nullopt;
  std::memcpy(&h, bytes.data(), sizeof h);
  const bool whole = h.header_hash == HashOf(h) && h.version == kRecordVersion && h.type <= 1;
  if (!whole || h.width > kLargestSide || h.height > kLargestSide || h.stride > 4 * kLargestSide)
    return std::nullopt;
  return Record{Record::Type(h.type), h.session,     h.index, InfoOf(h), h.missing,
                h.payload_bytes,      h.payload_hash};
}

}  // namespace polarscan
