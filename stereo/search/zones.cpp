// SPDX-License-Identifier: Apache-2.0
#include "stereo/search/zones.h"

namespace polarscan {

std::vector<std::vector<Offset>> MakeZones() {
  std::vector<std::vector<Offset>> zones;
  constexpr Offset kDirections[4] = {{0, -1}, {0, 1}, {-1, 0}, {1, 0}};
  for (const auto& [dx, dy] : kDirections) {
    std::vector<Offset> near_by, far_off;
    for (int k = 0; k < 4; ++k)
      for (int side = k ? -1 : 1; side <= 1; side += 2)
        near_by.push_back({(1 + k) * dx + side * k * dy, (1 + k) * dy + side * k * dx});
    for (int k = 0; k < 11; ++k) far_off.push_back({(3 + 2 * k) * dx, (3 + 2 * k) * dy});
    zones.push_back(near_by);
    zones.push_back(far_off);
  }
  return zones;
}

}  // namespace polarscan
