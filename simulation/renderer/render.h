// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/progress.h"
#include "simulation/camera_rings.h"
#include "simulation/renderer/lit_scene.h"
#include "simulation/sensor.h"

namespace polarscan {

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
double AutomaticGain(const LitScene& lit, const Pinhole& camera, const std::vector<SimulatedPose>& views,
                     const Progress& progress = {});

}  // namespace polarscan
