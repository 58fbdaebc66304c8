// SPDX-License-Identifier: Apache-2.0
#include "apps/checks/check_session.h"

#include <fmt/format.h>

#include <cmath>

#include "acquisition/input/options.h"
#include "acquisition/session/import_export.h"
#include "acquisition/session/session_repair.h"
#include "acquisition/session/session_views.h"
#include "core/error.h"

namespace polarscan {
namespace {

nlohmann::json ToJson(const Session& session) {
  nlohmann::json missing = nlohmann::json::array();
  for (const MissingFrames& m : session.missing)
    missing.push_back({{"first", m.first}, {"count", m.count}, {"reason", m.reason}});
  return {{"session", session.folder.string()},
          {"state", session.info.closed ? "closed" : "recording"},
          {"frames", session.frames.size()},
          {"counts", ToJson(session.info.counts)},
          {"missing", missing},
          {"unfinished", session.unfinished},
          {"damage", session.damage}};
}

// Where the camera's clock did not go on as ours did.
std::string ClockJumps(const Session& session) {
  std::string text;
  for (std::size_t i = 1; i < session.frames.size(); ++i) {
    const StoredFrame &before = session.frames[i - 1], &now = session.frames[i];
    const double jump = before.segment == now.segment ? ClockJump(before.info, now.info) : 0;
    if (std::abs(jump) > kClockJump_s)
      text += fmt::format("{}by {:.1f} s at frame {}", text.empty() ? "" : ", ", jump, now.info.sequence);
  }
  return text;
}

// What reconstruct could not read of the sensor's values.
void LookAtSensor(Session& session) {
  try {
    WithSensorJson(InputOptions(), SensorOf(session), session.folder / "session.json");
  } catch (const Error& error) {
    session.damage.push_back(error.what());
  }
}

}  // namespace

void CheckSession(const std::string& folder, bool repair, Context& context) {
  Session session = OpenSession(folder, Verify::kPayloads, context.progress);
  const bool frames_damaged = !session.damage.empty();
  LookAtSensor(session);
  for (const std::string& text : session.unfinished) context.progress.Info("not finished: " + text);
  for (const std::string& text : session.damage) context.progress.Warn(text);
  const std::string jumps = ClockJumps(session);
  if (!jumps.empty()) context.progress.Info("the camera's clock jumped " + jumps);
  const FrameCounts counts = session.info.counts;
  context.data_lost = !session.damage.empty() || counts.lost + counts.dropped > 0;
  if (repair && session.info.closed && frames_damaged)
    context.progress.Info(
        "--repair closes what was not closed; damaged frames cannot be made again. reconstruct, demosaic and "
        "export leave them out and use the whole ones; or copy the session again from where it was recorded");
  const nlohmann::json found = ToJson(session);
  std::string text = fmt::format("{} whole frames; {}", session.frames.size(), Describe(counts));
  if (!session.info.closed) text += repair ? "; now closed" : "; it was not closed (--repair does that)";
  if (repair) RepairSession(session);
  context.Finish(found, text);
}

}  // namespace polarscan
