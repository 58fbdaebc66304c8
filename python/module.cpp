// SPDX-License-Identifier: Apache-2.0
#include "core/error.h"
#include "python/bindings.h"

PYBIND11_MODULE(_polarscan, module) {
  namespace python = polarscan::python;
  module.attr("__version__") = POLARSCAN_VERSION;
  pybind11::register_exception<polarscan::Error>(module, "Error", PyExc_RuntimeError);
  python::BindDemosaic(module);
  python::BindSession(module);
  python::BindStereo(module);
}
