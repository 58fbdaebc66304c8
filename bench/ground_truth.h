// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "demosaic/method.h"

namespace polarscan::bench {

// Pictures of one scene behind polarizers at 0, 45, 90, 135 degrees at full resolution, red, green, blue,
// light in units of full scale.
struct TruthScene {
  std::string name;
  std::vector<AnglePlanes> colours;
};

// Every NAME_0.png with NAME_45, _90, _135 beside it, in the order of their names. Throws Error if there is
// none.
std::vector<TruthScene> ReadTruth(const std::filesystem::path& folder);

// What a mono sensor of this layout would have seen of one colour, a colour sensor of all three.
Image<float> SampleMono(const AnglePlanes& truth, const Layout& layout);
Image<float> SampleColour(const std::vector<AnglePlanes>& truth, const Layout& layout);

// S0, S1, S2 of four planes.
std::array<Image<float>, 3> ToStokes(const AnglePlanes& planes);

}  // namespace polarscan::bench
