// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "core/options.h"
#include "core/progress.h"
#include "simulation/camera_rings.h"
#include "simulation/renderer/lit_scene.h"
#include "simulation/renderer/render.h"
#include "simulation/scene/scene.h"
#include "simulation/sensor.h"

namespace polarscan {

// The simulated polarization camera: what it looks at, from where, and with which sensor. Help: Table().
struct SimulatorOptions {
  SceneOptions scene;
  std::string rings = "33:12,56:6";
  int width = 1224, height = 1024;
  double fov_deg = 35, fill = 0.8, jitter_deg = 2;
  int samples = 2;
  SimulatedSensor sensor;
  std::string layout = "90 45 / 135 0";
  double exposure = 1;
  bool masks = false, known_poses = false, turntable = false;
  std::uint64_t seed = 0;  // the program's --seed
};
OptionTable Table(SimulatorOptions& options);

// The camera before its pictures are taken: `width` x `height` raw pixels, horizontal field of view, centred.
Pinhole SimulatedPinhole(const SimulatorOptions& options);

// A scene ready to be photographed: lit, with the cameras in their places and the exposure set.
struct SimulatedShoot {
  LitScene lit;
  Pinhole camera;
  std::vector<SimulatedPose> views;
  double gain = 1;
};
SimulatedShoot PrepareShoot(Scene scene, const SimulatorOptions& options, Progress& progress);

// RenderFrame of one of its views; on a turntable the scene is lit anew, as the lamps stand with the camera.
Image<std::uint16_t> TakePicture(const SimulatedShoot& shoot, const SimulatedPose& view,
                                 const FrameSettings& settings, Progress& progress);

struct SimulationSummary {
  int views = 0;
  double gain = 0, distance = 0;
};

// Writes an INPUT folder: mosaic/NNNNNN.png (numbered as the shots of a session that saw the same), set.json,
// optionally masks/ and sparse/, and beside it truth/{mesh.ply, table.ply, board.json, sparse/}. set.json says
// "complete": false until everything is there. A folder that holds something else than an earlier simulation
// is refused (Error).
SimulationSummary Simulate(const SimulatorOptions& options, const std::filesystem::path& folder,
                           Progress& progress);
// The same without the pictures: what a recording of the simulated camera is compared with.
void SimulateTruth(const SimulatorOptions& options, const std::filesystem::path& folder, Progress& progress);

}  // namespace polarscan
