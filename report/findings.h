// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json.hpp>
#include <vector>

#include "report/scene/directions.h"
#include "report/scene/sample.h"

namespace polarscan {

struct FindingsInput {
  const CloudSample& sample;  // may be empty
  std::vector<CameraPlace> cameras;
  double dop_noise = 0;  // standard deviation of the degree of polarization of a pixel; 0: not polarized
  int min_views = 3;     // that fusion asked to agree
  const nlohmann::json& scan;   // scan.json
  const nlohmann::json& views;  // the page's
};

// What a user should know about how the object was photographed, and what to shoot next, in words:
// {coverage, list}. coverage: {step (degrees), cells [elevation from -90][azimuth from 0]: degrees to the
// nearest camera, cameras [{view, azimuth, elevation}]}, azimuth counted from the front (z) to the right (x).
// list: [{kind, title, text, from (direction to look from; optional), layer (to colour by; optional), good}],
// kind: registration, agreement, angles, coverage, underside, views, polarization, depth.
nlohmann::json Findings(const FindingsInput& input);

}  // namespace polarscan
