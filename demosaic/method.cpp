// SPDX-License-Identifier: Apache-2.0
#include "demosaic/method.h"

#include <cmath>

#include "core/error.h"
#include "demosaic/methods/bilinear.h"
#include "demosaic/methods/difference.h"
#include "demosaic/methods/linear.h"
#include "demosaic/methods/newton.h"
#include "demosaic/methods/residual.h"
#include "demosaic/methods/sharp.h"
#include "demosaic/methods/superpixel.h"

namespace polarscan {
namespace {

std::vector<std::string> MethodNames() {
  std::vector<std::string> names;
  for (const DemosaicMethod& method : DemosaicMethods()) names.push_back(method.name);
  return names;
}

}  // namespace

std::span<const DemosaicMethod> DemosaicMethods() {
  // Reach mono, colour; noise gain of S1, S2 mono, colour; of S0. tests/demosaic/methods_test.cpp measures
  // them.
  static const DemosaicMethod methods[] = {
      {"bilinear", "mean of the nearest samples of the same kind", InterpolateBilinear, 1, 3, 0.75, 0.3936,
       0.75, 0.3936},
      {"preview", "the same as bilinear, for live use", InterpolateBilinear, 1, 3, 0.75, 0.3936, 0.75,
       0.3936},
      {"superpixel", "the samples of a cell as they are, at half the resolution", RepeatSuperpixels, 1, 3, 1,
       0.527, 1, 0.527},
      {"difference", "differences to an edge-aware guide; fast", InterpolateDifference, 4, 15, 0.656, 0.5641,
       1.004, 0.778},
      {"newton", "Newton polynomials of differences along the smoother diagonal", InterpolateNewton, 3, 15,
       0.4577, 0.3916, 1.3187, 0.944},
      {"linear", "fitted kernels; fast, quiet S1 and S2", InterpolateLinear, 3, 15, 0.5747, 0.5162, 1.409, 1},
      {"eari", "residual interpolation with an edge-aware guide", InterpolateEari, 4, 15, 0.5824, 0.54,
       1.3555, 0.901},
      {"sharp", "residual interpolation in two passes with fitted kernels; the sharpest S0", InterpolateSharp,
       4, 15, 0.503, 0.4677, 1.543, 1.034},
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
