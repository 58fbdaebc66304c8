// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <pybind11/pybind11.h>

namespace polarscan::python {

// One function a file: what it adds to the module polarscan._polarscan. What users see, and its description,
// is polarscan/__init__.py.
void BindDemosaic(pybind11::module_& module);
void BindSession(pybind11::module_& module);
void BindStereo(pybind11::module_& module);

}  // namespace polarscan::python
