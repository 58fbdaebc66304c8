// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "demosaic/sensor/lit_mosaic.h"

namespace polarscan {

// One raw mosaic of a scene that was taken with several exposures.
struct Exposure {
  Image<float> counts;  // as stored
  double time = 1;      // any unit, the same for all
};

// Merges them before demosaicing, in light of the shortest exposure (full scale there is 1; what is dark gets
// the long ones' low noise). Weights are inverse variances: of the sensor's noise at the cell's mean level
// where its gain is known, else by exposure time, which is best for shot noise alone. A cell takes part only
// where none of its four samples is clipped, so that all four are always from the same exposures with the
// same weights: an exposure time that is not quite right then changes S0 a little and the polarization not at
// all. Where every exposure is clipped the shortest one counts, with what can be recovered. noise is set
// where the sensor's gain is known. Throws Error for none, different sizes, times that are not positive.
LitMosaic MergeExposures(const std::vector<Exposure>& exposures, const Sensor& sensor,
                         const MosaicCorrection& correction = {});

}  // namespace polarscan
