// SPDX-License-Identifier: Apache-2.0
#include <pybind11/eigen.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <optional>

#include "core/formats/image_io.h"
#include "demosaic/false_colour.h"
#include "pipeline/stereo/stereo.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "stereo/dense/source_views.h"
#include "stereo/map_io.h"
#include "stereo/workspace.h"

namespace polarscan::python {
namespace {

using Matrix34 = Eigen::Matrix<double, 3, 4>;

DenseView MakeView(std::size_t number, const Image<float>& s0, const Eigen::Matrix3d& k, const Matrix34& pose,
                   std::pair<double, double> depths) {
  DenseView view;
  view.name = std::to_string(1000000 + number).substr(1);
  if (std::abs(k(0, 1)) > 1e-9 * k(0, 0))
    throw Error("a camera matrix must not have skew", "view " + view.name);
  view.camera = {s0.width(), s0.height(), k(0, 0), k(1, 1), k(0, 2), k(1, 2)};
  view.cam_from_world = {pose.leftCols<3>(), pose.col(3)};
  view.depth_min = depths.first, view.depth_max = depths.second;
  return view;
}

float MaxOf(const Image<float>& image) {
  return image.size() ? *std::max_element(image.pixels().begin(), image.pixels().end()) : 0;
}

// views: (s0, s1, s2, noise, s0_noise, independence, mask or None, K, cam_from_world as 3x4, (nearest,
// farthest)).
void WriteArrays(const std::filesystem::path& folder, const py::list& views, bool polarized) {
  Workspace workspace{folder, {}, polarized};
  for (const py::handle& item : views) {
    const auto tuple = item.cast<py::tuple>();
    const StokesImage stokes{ToImage(tuple[0].cast<Array<float>>(), "s0"),
                             ToImage(tuple[1].cast<Array<float>>(), "s1"),
                             ToImage(tuple[2].cast<Array<float>>(), "s2"),
                             ToImage(tuple[3].cast<Array<float>>(), "noise"),
                             tuple[4].cast<double>(),
                             tuple[5].cast<double>()};
    const int number = int(workspace.views.size());
    workspace.views.push_back(MakeView(std::size_t(number), stokes.s0, tuple[7].cast<Eigen::Matrix3d>(),
                                       tuple[8].cast<Matrix34>(),
                                       tuple[9].cast<std::pair<double, double>>()));
    WriteStokes(workspace.StokesPath(number), stokes);
    WritePng(workspace.PicturePath(number), S0Picture(stokes, std::max(1e-30f, MaxOf(stokes.s0))));
    if (!tuple[6].is_none())
      WritePng(workspace.MaskPath(number), ToImage(tuple[6].cast<Array<std::uint8_t>>(), "mask"));
  }
  const auto sources = ChooseSourceViews(workspace.views, {});
  for (std::size_t i = 0; i < sources.size(); ++i) workspace.views[i].sources = sources[i];
  WriteWorkspace(workspace);
}

// While it runs, Ctrl-C and other threads of Python are heard.
void RunStereo(const std::filesystem::path& folder, const py::dict& arguments, int threads) {
  const nlohmann::json given = ToOptions(arguments);
  StereoOptions options = StereoPreset(given.value("preset", "default"));
  options.seed = 0;  // as the program's --seed
  OptionTable table = Table(options);
  FromJson(given, table);
  Progress progress;
  std::future<void> result = std::async(std::launch::async, [&] {
    std::optional<tbb::global_control> limit;
    if (threads > 0) limit.emplace(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
    EstimateMaps(folder, options, progress);
  });
  bool interrupted = false;
  {
    py::gil_scoped_release others_may_run;
    while (result.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) {
      py::gil_scoped_acquire hold;
      interrupted = interrupted || PyErr_CheckSignals() != 0;
      if (interrupted) progress.Cancel();
    }
  }
  if (interrupted) throw py::error_already_set();
  result.get();
}

}  // namespace

void BindStereo(py::module_& module) {
  module.def("write_arrays", &WriteArrays);
  module.def("estimate_depths", &RunStereo);
  module.def("stereo_options", [] {
    StereoOptions options;
    return ToPython(ValuesOf(options));
  });
  using Path = std::filesystem::path;
  module.def("read_depth_map", [](const Path& path) { return ToArray(ReadDepthMap(path)); });
  module.def("read_normal_map", [](const Path& path) { return ToArray(ReadNormalMap(path)); });
  module.def("write_depth_map", [](const Path& path, const Array<float>& depth) {
    WriteDepthMap(path, ToImage(depth, "depth"));
  });
  module.def("write_normal_map", [](const Path& path, const Array<float>& normal) {
    WriteNormalMap(path, ToNormals(normal, "normal"));
  });
}

}  // namespace polarscan::python
