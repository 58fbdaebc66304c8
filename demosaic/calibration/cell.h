// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <optional>

#include "demosaic/calibration/response.h"

namespace polarscan {

// The four samples of a 2x2 cell hold three unknowns, S0, S1, S2. One that is missing follows from the other
// three; for ideal polarizers it is I0 + I90 = I45 + I135, in general the one combination of the rows of
// `cell` that is zero. Nothing if the other three do not tell it.
std::optional<float> MissingSample(const CellMatrix& cell, const CellSamples& samples, int missing);

// What ideal polarizers would have read. S is the cell's light by least squares with the real responses, and
//   corrected = g sample + (ideal - g real) S,   g = ideal . real / real . real
// for each sample: the sample itself, with what S adds only for as much as its response is not a multiple of
// the ideal one. So a pure error of gain is undone exactly whatever the picture shows, light that is even
// over the cell comes out as ideal polarizers show it exactly, and at an edge inside of the cell only the few
// percent that the polarizer is off are taken from the neighbours. After Powell and Gruev, Opt. Express
// 21:21039, 2013 (super-pixel method), which replaces the whole sample.
CellSamples CorrectCell(const CellMatrix& real, const CellMatrix& ideal, const CellSamples& samples);

}  // namespace polarscan
