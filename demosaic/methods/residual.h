// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "demosaic/method.h"

namespace polarscan {

// Residual interpolation (Kiku, Monno, Tanaka, Okutomi, Minimized-Laplacian residual interpolation for color
// image demosaicking, 2014). The samples at one site of every 2x2 cell, column site_x and row site_y, are
// spread to all pixels with the help of a guide that is known everywhere:
//   in each window of 5x5 such samples (9x9 px) the samples are a guide + b, a from the ratio of Laplacians
//   taken on the samples' own lattice, b from the means;
//   a and b of a pixel are the mean over the windows around, weighted by 1 / (mean squared misfit);
//   what the samples still differ from a guide + b is interpolated bilinearly and added.
// Windows are centred at the samples' sites only, a quarter of the pixels, and a, b interpolated between
// them: measured as good as windows everywhere (within 0.1 dB), at a quarter of the cost. The samples
// themselves come back unchanged. Looks 11 px far, weakly beyond 2.
Image<float> FillByResidual(const Image<float>& samples, const Image<float>& guide, int site_x, int site_y);

// Every angle of a mono mosaic filled so.
AnglePlanes FillAnglesByResidual(const Image<float>& samples, const Layout& layout,
                                 const Image<float>& guide);

// EARI: residual interpolation with the edge-aware guide (guide.h), Morimatsu et al. 2020.
std::vector<AnglePlanes> InterpolateEari(const Image<float>& samples, const Layout& layout);

}  // namespace polarscan
