// SPDX-License-Identifier: Apache-2.0
// mean_polarization VIEW.tif: the mean degree of polarization of a Stokes view (polarscan demosaic makes
// them).
#include <iostream>

#include "demosaic/stokes.h"

int main(int argc, char** argv) {
  if (argc != 2) return std::cerr << "mean_polarization VIEW.tif\n", 2;
  try {
    const polarscan::StokesImage view = polarscan::ReadStokes(argv[1]);
    double sum = 0;
    for (int y = 0; y < view.s0.height(); ++y)
      for (int x = 0; x < view.s0.width(); ++x)
        sum += polarscan::DegreeOfPolarization(view.s0(x, y), view.s1(x, y), view.s2(x, y));
    std::cout << "mean degree of polarization " << sum / double(view.s0.size()) << "\n";
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
