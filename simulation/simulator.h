// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "core/options.h"
#include "core/progress.h"
#include "simulation/scene.h"
#include "simulation/simulator_light.h"
#include "simulation/simulator_sensor.h"
#include "simulation/simulator_views.h"

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
  bool masks = false, known_poses = false;
  std::uint64_t seed = 0;  // the program's --seed
};
OptionTable Table(SimulatorOptions& options);

// The camera before its pictures are taken: `width` x `height` raw pixels, horizontal field of view, centred.
Pinhole SimulatedPinhole(const SimulatorOptions& options);

// How a raw frame is taken. gain: full wells per unit of radiance through an open polarizer.
struct FrameSettings {
  SimulatedSensor sensor;
  int samples = 2;  // per raw pixel and axis
  double gain = 1;
  std::uint64_t seed = 0, frame = 0;  // key of the noise
};

// Noise-free Stokes vectors (S0, S1, S2; radiance) of every raw pixel, mean of samples x samples rays.
Image<Eigen::Vector3f> RenderStokes(const LitScene& lit, const Pinhole& camera, const Rigid& cam_from_world,
                                    int samples, const Progress& progress);

// One raw mosaic as the sensor would send it. The same arguments give the same counts for any number of
// threads.
Image<std::uint16_t> RenderFrame(const LitScene& lit, const Pinhole& camera, const Rigid& cam_from_world,
                                 const FrameSettings& settings, Progress& progress);

// 255 where the object covers the middle of the pixel.
Image<std::uint8_t> RenderMask(const LitScene& lit, const Pinhole& camera, const Rigid& cam_from_world,
                               const Progress& progress = {});

// The gain at which 0.5 % of the lit pixels of these views clip in their brightest polarizer.
double AutomaticGain(const LitScene& lit, const Pinhole& camera, const std::vector<SimulatedView>& views,
                     const Progress& progress = {});

// A scene ready to be photographed: lit, with the cameras in their places and the exposure set.
struct SimulatedShoot {
  LitScene lit;
  Pinhole camera;
  std::vector<SimulatedView> views;
  double gain = 1;
};
SimulatedShoot PrepareShoot(Scene scene, const SimulatorOptions& options, Progress& progress);

struct SimulationSummary {
  int views = 0;
  double gain = 0, distance = 0;
};

// Writes an INPUT folder: mosaic/NNNNNN.png (numbered as the shots of a session that saw the same), set.json,
// optionally masks/ and sparse/, and beside it truth/{mesh.ply, table.ply, sparse/}. set.json says
// "complete": false until everything is there. A folder that holds something else than an earlier simulation
// is refused (Error).
SimulationSummary Simulate(const SimulatorOptions& options, const std::filesystem::path& folder,
                           Progress& progress);
// The same without the pictures: what a recording of the simulated camera is compared with.
void SimulateTruth(const SimulatorOptions& options, const std::filesystem::path& folder, Progress& progress);

}  // namespace polarscan
