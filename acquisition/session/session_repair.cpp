// SPDX-License-Identifier: Apache-2.0
#include "acquisition/session/session_repair.h"

#include <filesystem>

namespace polarscan {

void RepairSession(Session& session) {
  if (session.info.closed) return;
  if (session.segments > 0)
    std::filesystem::resize_file(SegmentPath(session.folder, session.segments - 1),
                                 session.last_segment_bytes);
  session.info.closed = true;
  session.info.records = session.records;
  session.info.segments = session.segments;
  WriteSessionInfo(session.folder, session.info);
  session = OpenSession(session.folder);
}

}  // namespace polarscan
