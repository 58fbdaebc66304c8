// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/camera/camera.h"
#include "simulation/simulator.h"

namespace polarscan {

struct SimulatedCameraOptions {
  SimulatorOptions simulator;
  std::string pixel_format = "Mono12p";
  double fps = 12;
  int hold = 1;           // frames from one place before the camera goes on to the next
  double frame_loss = 0;  // share of the frames that never come
  int prepared = 0;       // rounds of frames made at Start and sent again and again; 0: each frame is new
};
OptionTable Table(SimulatedCameraOptions& options);

// The scene of `polarscan simulate` as a camera that goes round and round it. Features: the rows of Table.
// The noise-free pictures are rendered once, at Start; each frame then gets noise of its own (normal, with
// the shot and read noise's variance), so frame n is the same in every run with the same seed.
std::unique_ptr<Camera> OpenSimulatedCamera(const SimulatedCameraOptions& options);

}  // namespace polarscan
