// SPDX-License-Identifier: Apache-2.0
// fit_kernels TRUTH OUTPUT: fits the kernels of demosaic/methods/linear.h to all planes in TRUTH
// (bench/ground_truth.h) and writes them as demosaic/methods/linear_kernels.inc.
#include <fmt/format.h>

#include <cstdio>

#include "bench/kernel_fit.h"
#include "core/error.h"
#include "core/files/files.h"

namespace polarscan::bench {
namespace {

std::string ToText(const LinearKernels::Kernel& kernel, const char* name) {
  std::string text = fmt::format("// {}\n{{", name);
  for (std::size_t i = 0; i < kernel.size(); ++i)
    text += fmt::format("{:.7e}f{}", kernel[i], i + 1 == kernel.size() ? "},\n" : i % 4 == 3 ? ",\n " : ", ");
  return text;
}

std::string ToText(const LinearKernels::Set& set, const char* name) {
  return fmt::format("// {}\n{{\n", name) + ToText(set.s0, "S0") + ToText(set.first, "first carrier") +
         ToText(set.second, "second carrier") + "},\n";
}

std::string ToText(const LinearKernels& kernels) {
  return "// SPDX-License-Identifier: Apache-2.0\n// Written by bench/fit_kernels; taps at (|x|, |y|), rows "
         "of |x| = 0 ... 3.\n" +
         ToText(kernels.across, "orthogonal polarizers across the cell") +
         ToText(kernels.in_row, "orthogonal polarizers in the same row") +
         ToText(kernels.sharpen_mosaic, "sharpen: on 2 M") + ToText(kernels.sharpen_s0, "sharpen: on S0");
}

void Run(const char* truth, const char* output) {
  KernelSums sums;
  for (const TruthScene& scene : ReadTruth(truth))
    for (const AnglePlanes& plane : scene.colours) sums += SumPlane(plane);
  WriteFileAtomically(output, ToText(Solve(sums)));
}

}  // namespace
}  // namespace polarscan::bench

int main(int argc, char** argv) {
  if (argc != 3) return std::fputs("usage: fit_kernels TRUTH OUTPUT\n", stderr), 2;
  try {
    polarscan::bench::Run(argv[1], argv[2]);
  } catch (const std::exception& error) {
    return std::fprintf(stderr, "fit_kernels: %s\n", error.what()), 1;
  }
}
