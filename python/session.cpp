// SPDX-License-Identifier: Apache-2.0
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>

#include "acquisition/session/session_views.h"
#include "python/arrays.h"
#include "python/bindings.h"

namespace polarscan::python {
namespace {

py::dict Describe(const FrameInfo& info) {
  py::dict frame;
  frame["sequence"] = info.sequence;
  frame["shot"] = info.shot;
  frame["name"] = info.name;
  frame["width"] = info.width;
  frame["height"] = info.height;
  frame["pixel_format"] = info.pixel_format;
  frame["exposure_us"] = info.exposure_us;
  frame["gain_db"] = info.gain_db;
  frame["temperature_c"] = info.temperature_c;
  frame["camera_time_ns"] = info.camera_time_ns;
  frame["host_time_ns"] = info.host_time_ns;
  return frame;
}

py::list Frames(const Session& session) {
  py::list frames;
  for (const StoredFrame& frame : session.frames) frames.append(Describe(frame.info));
  return frames;
}

std::vector<std::string> ViewNames(const Session& session) {
  std::vector<std::string> names;
  for (const SessionView& view : ViewsOf(session)) names.push_back(view.name);
  return names;
}

Array<float> ViewCounts(const Session& session, const std::string& name) {
  const std::vector<SessionView> views = ViewsOf(session);
  const auto view = std::ranges::find(views, name, &SessionView::name);
  if (view == views.end()) throw Error("the session has no view " + name, session.folder.string());
  return ToArray(MedianCounts(session, *view));
}

Array<std::uint16_t> FrameCountsOf(const Session& session, std::size_t frame) {
  if (frame >= session.frames.size())
    throw py::index_error("the session has " + std::to_string(session.frames.size()) + " frames");
  return ToArray(Counts(ReadFrame(session, frame)));
}

py::list Missing(const Session& session) {
  py::list all;
  for (const MissingFrames& missing : session.missing)
    all.append(py::make_tuple(missing.first, missing.count, missing.reason));
  return all;
}

}  // namespace

void BindSession(py::module_& module) {
  py::class_<Session>(module, "Session", "A recorded session, opened for reading.")
      .def(py::init([](const std::filesystem::path& folder) { return OpenSession(folder); }),
           py::arg("folder"))
      .def_property_readonly("folder", [](const Session& s) { return s.folder; })
      .def_property_readonly("camera", [](const Session& s) { return ToPython(s.info.camera); })
      .def_property_readonly("settings", [](const Session& s) { return ToPython(s.info.settings); })
      .def_property_readonly(
          "sensor", [](const Session& s) { return ToPython(SensorOf(s)); },
          "What is known of it, by the keys of set.json: layout, bits, black_dn, ...")
      .def_property_readonly("frames", &Frames, "A dict a frame that is stored whole, in order.")
      .def_property_readonly("missing", &Missing, "(first sequence number, count, reason) each.")
      .def_readonly("damage", &Session::damage, "A sentence for each thing that cannot be read any more.")
      .def_property_readonly("views", &ViewNames, "Names; a view is the frames of one shot.")
      .def("frame", &FrameCountsOf, py::arg("number"),
           "Counts of the frame in place `number` of frames: uint16, height x width.")
      .def("counts", &ViewCounts, py::arg("view"),
           "Counts of a view, the median of its frames: float32, height x width.");
}

}  // namespace polarscan::python
