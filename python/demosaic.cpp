// SPDX-License-Identifier: Apache-2.0
#include <pybind11/stl/filesystem.h>

#include <cmath>

#include "demosaic/method.h"
#include "demosaic/polar_view.h"
#include "demosaic/stokes.h"
#include "python/arrays.h"
#include "python/bindings.h"

namespace polarscan::python {
namespace {

py::tuple ToTuple(const StokesImage& stokes) {
  return py::make_tuple(ToArray(stokes.s0), ToArray(stokes.s1), ToArray(stokes.s2), ToArray(stokes.noise),
                        stokes.s0_noise, stokes.independence);
}

struct SensorArguments {
  std::string layout;
  int bits;
  double black, white, dn_per_e, read_noise_e;
};

Sensor ToSensor(const SensorArguments& a) {
  Sensor sensor;
  sensor.layout = ParseLayout(a.layout);
  sensor.bits = a.bits;
  sensor.black_dn = a.black;
  sensor.white_dn = a.white > 0 ? a.white : std::exp2(a.bits) - 1;
  sensor.dn_per_e = a.dn_per_e;
  sensor.read_noise_e = a.read_noise_e;
  return sensor;
}

py::tuple Demosaic(const Array<float>& counts, const SensorArguments& a, const std::string& method) {
  const Image<float> image = ToImage(counts, "counts");
  const Sensor sensor = ToSensor(a);
  PolarView view;
  {
    py::gil_scoped_release others_may_run;
    CheckMosaic(image, sensor, "counts");
    view = ViewFromMosaic(image, sensor, FindDemosaicMethod(method));
  }
  return ToTuple(view.stokes);
}

py::list Methods() {
  py::list names;
  for (const DemosaicMethod& method : DemosaicMethods()) names.append(method.name);
  return names;
}

}  // namespace

void BindDemosaic(py::module_& module) {
  module.def(
      "demosaic",
      [](const Array<float>& counts, const std::string& layout, int bits, double black, double white,
         double dn_per_e, double read_noise_e, const std::string& method) {
        return Demosaic(counts, {layout, bits, black, white, dn_per_e, read_noise_e}, method);
      },
      py::arg("counts"), py::arg("layout"), py::arg("bits"), py::arg("black"), py::arg("white"),
      py::arg("dn_per_e"), py::arg("read_noise_e"), py::arg("method"));
  module.def("demosaic_methods", &Methods);
  module.def("aop", py::vectorize(AngleOfPolarization), py::arg("s1"), py::arg("s2"));
  module.def("dop", py::vectorize(DegreeOfPolarization), py::arg("s0"), py::arg("s1"), py::arg("s2"));
  module.def("read_stokes", [](const std::filesystem::path& path) { return ToTuple(ReadStokes(path)); });
  module.def("write_stokes",
             [](const std::filesystem::path& path, const Array<float>& s0, const Array<float>& s1,
                const Array<float>& s2, const Array<float>& noise, double s0_noise, double independence) {
               const StokesImage stokes{ToImage(s0, "s0"),       ToImage(s1, "s1"), ToImage(s2, "s2"),
                                        ToImage(noise, "noise"), s0_noise,          independence};
               if (!SameSize(stokes.s0, stokes.s1) || !SameSize(stokes.s0, stokes.s2) ||
                   !SameSize(stokes.s0, stokes.noise))
                 throw Error("S0, S1, S2 and noise must be of one size", path.string());
               WriteStokes(path, stokes);
             });
}

}  // namespace polarscan::python
