// SPDX-License-Identifier: Apache-2.0
#include "acquisition/session/session_writer.h"

#include <fmt/format.h>
#include <unistd.h>

#include <random>

#include "core/error.h"
#include "core/files/files.h"

namespace polarscan {
namespace {

std::string_view BytesOf(const std::vector<std::uint8_t>& payload) {
  return {reinterpret_cast<const char*>(payload.data()), payload.size()};
}

}  // namespace

SessionInfo NewSessionInfo() {
  SessionInfo info;
  std::random_device device;
  info.id = std::uint64_t(device()) << 32 | device();
  info.created = TimeNow();
  return info;
}

void RequireNewSessionFolder(const std::filesystem::path& folder) {
  if (std::filesystem::exists(folder) && !std::filesystem::is_directory(folder))
    throw Error("there is a file of this name already", folder.string(), "Give an empty or a new folder");
  if (std::filesystem::exists(folder) && !std::filesystem::is_empty(folder))
    throw Error("the folder holds something already", folder.string(), "Give an empty or a new folder");
  std::filesystem::path above = std::filesystem::absolute(folder).lexically_normal();
  while (!std::filesystem::exists(above)) above = above.parent_path();
  if (::access(above.c_str(), W_OK) != 0) ThrowSystemError("cannot write here", above);
}

SessionWriter::SessionWriter(const std::filesystem::path& folder, SessionInfo info,
                             std::uint64_t segment_bytes, AppendFileMaker make_file)
    : folder_(folder),
      info_(std::move(info)),
      segment_bytes_(segment_bytes),
      make_file_(std::move(make_file)) {
  RequireNewSessionFolder(folder);
  CreateFolder(folder / "segments");
  WriteSessionInfo(folder, info_);
  SyncFolder(std::filesystem::absolute(folder).lexically_normal().parent_path());
}

void SessionWriter::Append(const Frame& frame) {
  Record record;
  record.info = frame.info;
  record.payload_bytes = frame.payload.size();
  record.payload_hash = Hash(BytesOf(frame.payload));
  Write(record, BytesOf(frame.payload));
}

void SessionWriter::AppendMissing(std::uint64_t first, std::uint64_t count, const std::string& reason) {
  Record record;
  record.type = Record::Type::kMissing;
  record.info.sequence = first;
  record.info.name = reason.substr(0, 63);
  record.missing = count;
  record.payload_hash = Hash({});
  Write(record, {});
}

void SessionWriter::Write(Record record, std::string_view payload) {
  if (!file_ || new_segment_ || written_ >= segment_bytes_) BeginSegment();
  record.session = info_.id;
  record.index = info_.records;
  const std::string header = EncodeHeader(record);
  try {
    file_->Append(header, payload);
  } catch (...) {
    try {
      file_->Truncate(written_);
    } catch (const Error&) {  // the reader cuts it off
    }
    throw;
  }
  written_ += header.size() + payload.size();
  ++info_.records;
}

void SessionWriter::BeginSegment() {
  Sync();
  file_ = make_file_(SegmentPath(folder_, info_.segments));
  ++info_.segments;
  written_ = 0;
  new_segment_ = false;
}

void SessionWriter::NewSegment() { new_segment_ = written_ > 0; }

void SessionWriter::Sync() {
  if (!file_) return;
  if (sync_failed_) throw Error("the disk has failed before", folder_.string());
  sync_failed_ = true;  // until it is known to be good
  file_->Sync();
  sync_failed_ = false;
}

void SessionWriter::Close(const FrameCounts& counts) {
  Sync();
  info_.counts = counts;
  info_.closed = true;
  WriteSessionInfo(folder_, info_);
}

}  // namespace polarscan
