// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/mesh.h"

namespace polarscan {

struct SimulatedPose {
  std::string name;  // "000", "001", ...
  Rigid cam_from_world;
  double turn_rad =
      0;  // on a turntable: of the camera, the lamps and the room about y, as the object sees it
};

struct CameraRing {
  double elevation_deg = 0;
  int views = 0;
};

// "elevation in degrees:views, ...", for example "33:12,56:6". Throws Error on anything else.
std::vector<CameraRing> ParseRings(const std::string& text);

// Cameras on rings around the origin, all at one distance and looking at it (world y up). Each ring is turned
// by a third of its step against the one before. jitter_deg: largest deviation of elevation, azimuth and
// roll; on a turntable, where the camera of a ring stands still, of the azimuth alone. The distance is the smallest at which the object stays within `fill` of the half picture in every
// view.
std::vector<SimulatedPose> RingViews(const std::vector<CameraRing>& rings, double jitter_deg,
                                     std::uint64_t seed, const TriangleMesh& object, const Pinhole& camera,
                                     double fill, bool turntable = false);

// cameras.txt, images.txt (NAME.png) and an empty points3D.txt: COLMAP's text model of the true poses.
void WriteTruePoses(const std::filesystem::path& folder, const Pinhole& camera,
                    const std::vector<SimulatedPose>& views);

}  // namespace polarscan
