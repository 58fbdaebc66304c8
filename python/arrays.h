// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "core/error.h"
#include "core/image.h"

namespace polarscan::python {
namespace py = pybind11;

template <class T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

// Height x width, row by row; the values are copied.
template <class T>
Array<T> ToArray(const Image<T>& image) {
  Array<T> array({image.height(), image.width()});
  std::ranges::copy(image.pixels(), array.mutable_data());
  return array;
}

// Height x width x 3.
inline Array<float> ToArray(const Image<Eigen::Vector3f>& image) {
  Array<float> array({image.height(), image.width(), 3});
  float* to = array.mutable_data();
  for (const Eigen::Vector3f& value : image.pixels()) to = std::copy_n(value.data(), 3, to);
  return array;
}

// Throws Error if the array has not that many dimensions; what: the argument's name.
inline void CheckDimensions(const py::array& array, int dimensions, const std::string& what) {
  if (array.ndim() == dimensions) return;
  const std::string wanted = dimensions == 2 ? "height x width" : "height x width x 3";
  throw Error("an array must be " + wanted + ", this one has " + std::to_string(array.ndim()) + " dimensions",
              what);
}

template <class T>
Image<T> ToImage(const Array<T>& array, const std::string& what) {
  CheckDimensions(array, 2, what);
  Image<T> image(int(array.shape(1)), int(array.shape(0)));
  std::copy_n(array.data(), image.size(), image.pixels().begin());
  return image;
}

inline Image<Eigen::Vector3f> ToNormals(const Array<float>& array, const std::string& what) {
  CheckDimensions(array, 3, what);
  if (array.shape(2) != 3) throw Error("normals have three components", what);
  Image<Eigen::Vector3f> image(int(array.shape(1)), int(array.shape(0)));
  const float* from = array.data();
  for (Eigen::Vector3f& value : image.pixels()) value = Eigen::Vector3f(from[0], from[1], from[2]), from += 3;
  return image;
}

inline py::object ToPython(const nlohmann::json& value) {
  return py::module_::import("json").attr("loads")(value.dump());
}

// Options by name, as on the command line or with underscores.
inline nlohmann::json ToOptions(const py::dict& arguments) {
  const auto text = py::module_::import("json").attr("dumps")(arguments).cast<std::string>();
  nlohmann::json options = nlohmann::json::object();
  const nlohmann::json given = nlohmann::json::parse(text);
  for (const auto& [key, value] : given.items()) {
    std::string name = key;
    std::ranges::replace(name, '_', '-');
    options[name] = value;
  }
  return options;
}

}  // namespace polarscan::python
