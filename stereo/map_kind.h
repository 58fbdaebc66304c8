// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace polarscan {

// Which of a view's depth and normal maps. The result is kGeometric, or kPhotometric where no geometric pass
// was asked for; the others are there while stereo goes on.
enum class MapStage {
  kPhotometric,
  kGeometric,
  kStep,      // of a step of the coarse-to-fine schedule (pipeline/stereo/schedules/multilevel.h)
  kSeparate,  // of its last step, where a surface of all views follows
  kSurface    // from such a surface (pipeline/stereo/surface_steps.h)
};

struct MapKind {
  MapStage stage = MapStage::kGeometric;
  int number = 0;  // of the step (from 0) or of the surface (from 1)

  bool operator==(const MapKind&) const = default;
};

inline constexpr MapKind kFinalMaps{MapStage::kGeometric}, kPhotometricMaps{MapStage::kPhotometric},
    kSeparateMaps{MapStage::kSeparate};
inline constexpr MapKind kResults[] = {kFinalMaps, kPhotometricMaps};  // best first

// As in file names: "geometric", "photometric", "step3", "separate", "step-surface1".
std::string ToString(const MapKind& kind);
// What all of those begin with that are left when stereo was stopped, or ended with other options.
inline constexpr const char* kPassingMaps = "step";

// The result of that name. Throws Error if it is none.
MapKind ParseResult(const std::string& name);

}  // namespace polarscan
