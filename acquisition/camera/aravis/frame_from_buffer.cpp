// SPDX-License-Identifier: Apache-2.0
#include "acquisition/camera/aravis/frame_from_buffer.h"

#include <span>
#include <utility>

#include "acquisition/camera/aravis/glib_objects.h"
#include "demosaic/sensor/pixel_format.h"

namespace polarscan::aravis {
namespace {

std::string ReasonOf(ArvBufferStatus status) {
  switch (status) {
    case ARV_BUFFER_STATUS_TIMEOUT:
      return "parts never came";
    case ARV_BUFFER_STATUS_MISSING_PACKETS:
      return "parts are missing";
    case ARV_BUFFER_STATUS_WRONG_PACKET_ID:
      return "parts out of order";
    case ARV_BUFFER_STATUS_SIZE_MISMATCH:
      return "size differs from what was announced";
    case ARV_BUFFER_STATUS_ABORTED:
      return "broken off";
    default:
      return "incomplete";
  }
}

// What the camera says of this very picture.
void ReadChunks(ArvBuffer* buffer, ArvChunkParser* chunks, FrameInfo& info) {
  if (!arv_buffer_has_chunks(buffer)) return;
  for (const auto& [name, value] :
       {std::pair{"ChunkExposureTime", &info.exposure_us}, std::pair{"ChunkGain", &info.gain_db}}) {
    Failure failure;
    const double read = arv_chunk_parser_get_float_value(chunks, buffer, name, &failure);
    if (!failure) *value = read;
  }
}

// Each chunk has its length behind it, in its last four bytes; 0 if the lengths do not add up.
std::size_t FirstChunkBytes(std::span<const std::uint8_t> payload) {
  constexpr std::size_t kTag = 8;
  while (payload.size() >= kTag) {
    const std::span<const std::uint8_t> tag = payload.last(4);
    const std::size_t length = std::size_t(tag[0]) << 24 | tag[1] << 16 | tag[2] << 8 | tag[3];
    if (length + kTag == payload.size()) return length;
    if (length + kTag > payload.size()) return 0;
    payload = payload.first(payload.size() - kTag - length);
  }
  return 0;
}

// Of the picture, as far as the packets say how many came.
std::size_t ReceivedBytes(ArvBuffer* buffer, const FrameShape& shape) {
  std::size_t bytes = 0;
  const void* data = arv_buffer_get_image_data(buffer, &bytes);
  if (arv_buffer_has_chunks(buffer) && shape.gige)
    bytes = FirstChunkBytes({static_cast<const std::uint8_t*>(data), bytes});
  return bytes;
}

// The picture's bytes, without what comes behind it.
std::size_t PictureBytes(ArvBuffer* buffer, const FrameInfo& info) {
  if (arv_buffer_has_chunks(buffer))
    return PayloadBytes(ParsePixelFormat(info.pixel_format), info.width, info.height,
                        std::size_t(info.stride));
  std::size_t bytes = 0;
  arv_buffer_get_image_data(buffer, &bytes);
  return bytes;
}

// What is wrong with a buffer of which all packets came.
std::string WhatIsWrongWithWhole(ArvBuffer* buffer, const FrameShape& shape, ArvChunkParser* chunks,
                                 FrameInfo& info) {
  if (arv_buffer_get_payload_type(buffer) != ARV_BUFFER_PAYLOAD_TYPE_IMAGE) return "not a picture";
  ReadChunks(buffer, chunks, info);
  int x_padding = 0, y_padding = 0;
  info.width = arv_buffer_get_image_width(buffer);
  info.height = arv_buffer_get_image_height(buffer);
  arv_buffer_get_image_padding(buffer, &x_padding, &y_padding);
  const PixelFormat format = ParsePixelFormat(shape.pixel_format);
  if (x_padding > 0) info.stride = int(RowBytes(format, info.width)) + x_padding;
  const std::uint32_t code = arv_buffer_get_image_pixel_format(buffer);
  if (code != shape.code || info.width != shape.width || info.height != shape.height)
    return "the picture's format or size changed";
  const std::size_t needed = PayloadBytes(format, info.width, info.height, std::size_t(info.stride));
  return ReceivedBytes(buffer, shape) < needed ? "too few bytes" : "";
}

}  // namespace

bool HoldsAFrame(ArvBuffer* buffer, const FrameShape& shape) {
  const ArvBufferStatus status = arv_buffer_get_status(buffer);
  // Newer versions of Aravis have a status behind "aborted" for a packet that belongs to no frame.
  if (status == ARV_BUFFER_STATUS_CLEARED || status > ARV_BUFFER_STATUS_ABORTED) return false;
  return !shape.gige || arv_buffer_get_frame_id(buffer) != 0;
}

std::string WhatIsWrong(ArvBuffer* buffer, const FrameShape& shape, ArvChunkParser* chunks, FrameInfo& info) {
  const ArvBufferStatus status = arv_buffer_get_status(buffer);
  return status == ARV_BUFFER_STATUS_SUCCESS ? WhatIsWrongWithWhole(buffer, shape, chunks, info)
                                             : ReasonOf(status);
}

Payload TakePicture(ArvBuffer* buffer, const FrameInfo& info, Payload& picture) {
  auto* payload = const_cast<Payload*>(static_cast<const Payload*>(arv_buffer_get_user_data(buffer)));
  const std::size_t bytes = PictureBytes(buffer, info);
  picture.swap(*payload);
  picture.resize(bytes);
  return std::move(*payload);
}

}  // namespace polarscan::aravis
