// SPDX-License-Identifier: Apache-2.0
#include "demosaic/method.h"

#include <cmath>

#include "core/error.h"
#include "demosaic/bilinear.h"

namespace polarscan {
namespace {

std::vector<std::string> MethodNames() {
  std::vector<std::string> names;
  for (const DemosaicMethod& method : DemosaicMethods()) names.push_back(method.name);
  return names;
}

}  // namespace

std::span<const DemosaicMethod> DemosaicMethods() {
  // Noise gains: sums of squared weights over the phases; tests/demosaic/bilinear_test.cpp measures them.
  static const DemosaicMethod methods[] = {
      {"bilinear", "mean of the nearest samples of the same kind", InterpolateBilinear, 1, 3, 0.75, 0.3936},
  };
  return methods;
}

const DemosaicMethod& FindDemosaicMethod(const std::string& name) {
  std::string known;
  for (const DemosaicMethod& method : DemosaicMethods()) {
    if (method.name == name) return method;
    known += (known.empty() ? "" : ", ") + method.name;
  }
  throw Error("there is no demosaicing method of this name", name, "Known: " + known);
}

OptionTable Table(DemosaicOptions& options) {
  std::string help = "How mosaics become full pictures";
  for (const DemosaicMethod& method : DemosaicMethods()) help += "; " + method.name + ": " + method.help;
  return {{.name = "demosaic", .value = &options.method, .help = help, .choices = MethodNames()}};
}

}  // namespace polarscan
