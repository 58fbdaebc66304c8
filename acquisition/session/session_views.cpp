// SPDX-License-Identifier: Apache-2.0
#include "acquisition/session/session_views.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "core/error.h"
#include "demosaic/sensor/pixel_format.h"

namespace polarscan {
namespace {

float Median(std::vector<std::uint16_t>& values) {
  const std::size_t middle = values.size() / 2;
  std::ranges::sort(values);
  return values.size() % 2 ? float(values[middle])
                           : 0.5f * (float(values[middle - 1]) + float(values[middle]));
}

}  // namespace

std::vector<SessionView> ViewsOf(const Session& session) {
  std::map<std::string, SessionView> views;
  for (std::size_t i = 0; i < session.frames.size(); ++i) {
    const FrameInfo& info = session.frames[i].info;
    const bool usable = !info.name.empty() && info.name[0] != '.' && info.name.find('/') == std::string::npos;
    const std::string name = usable ? info.name : fmt::format("{:06}", info.shot);
    views[name].name = name;
    views[name].frames.push_back(i);
  }
  std::vector<SessionView> sorted;
  for (auto& [name, view] : views) sorted.push_back(std::move(view));
  return sorted;
}

std::vector<double> ExposuresOf(const Session& session, const SessionView& view) {
  std::vector<double> times;
  for (const std::size_t frame : view.frames) times.push_back(session.frames[frame].info.exposure_us);
  const auto [low, high] = std::ranges::minmax(times);
  const bool known = std::ranges::all_of(times, [](double time) { return time > 0; });
  return known && high > 1.01 * low ? times : std::vector<double>();
}

nlohmann::json SensorOf(const Session& session) {
  nlohmann::json sensor = session.info.sensor.is_object() ? session.info.sensor : nlohmann::json::object();
  if (!sensor.contains("bits") && !session.frames.empty())
    sensor["bits"] = ParsePixelFormat(session.frames[0].info.pixel_format).bits;
  return sensor;
}

Image<std::uint16_t> Counts(const Frame& frame) {
  const FrameInfo& info = frame.info;
  return Unpack(ParsePixelFormat(info.pixel_format), frame.payload, info.width, info.height,
                std::size_t(info.stride));
}

Image<float> MedianCounts(const Session& session, const SessionView& view) {
  std::vector<Image<std::uint16_t>> frames;
  for (const std::size_t index : view.frames) {
    frames.push_back(Counts(ReadFrame(session, index)));
    if (!SameSize(frames[0], frames.back()))
      throw Error("the frames of one shot differ in size",
                  fmt::format("{} in {}", view.name, session.folder.string()));
  }
  Image<float> median(frames[0].width(), frames[0].height());
  std::vector<std::uint16_t> values(frames.size());
  for (std::size_t i = 0; i < median.size(); ++i) {
    for (std::size_t k = 0; k < frames.size(); ++k) values[k] = frames[k].pixels()[i];
    median.pixels()[i] = Median(values);
  }
  return median;
}

}  // namespace polarscan
