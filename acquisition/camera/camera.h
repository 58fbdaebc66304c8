// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "acquisition/camera/frame.h"
#include "core/error.h"
#include "core/progress.h"

namespace polarscan {

// id: what OpenCamera takes: Aravis' id, "replay:FOLDER" (and simulation/cameras.h "simulated").
struct CameraInfo {
  std::string id, vendor, model, serial;
};
nlohmann::json ToJson(const CameraInfo& info);

// There is no camera of this name now.
class NoSuchCamera : public Error {
 public:
  using Error::Error;
};

// How a call to Next ended.
enum class Delivery {
  kFrame,      // a whole frame
  kDamaged,    // a frame that is not whole: only its sequence number and reason (info.name) are there
  kRestarted,  // the camera was gone and is back: info.sequence is the next frame's, info.name says how long
  kNothing,    // none came in time
  kEnded,      // none will come any more
};

// A camera that is open. The same for all backends; above this line nobody knows which one it is. One thread
// at a time; Next may run on another thread than the rest.
class Camera {
 public:
  virtual ~Camera() = default;
  virtual CameraInfo info() const = 0;
  // What the pictures mean, as "sensor" in set.json (docs/input.md). What the camera does not tell is not
  // there.
  virtual nlohmann::json sensor() const = 0;
  // {name: value} of everything that can be set or read. Throws Error if the camera does not answer.
  virtual nlohmann::json features() const = 0;
  // Before Start. Throws Error if there is no such feature or its value is not allowed.
  virtual void Set(const std::string& feature, const std::string& value) = 0;

  // Before Start: frames come only when Trigger asks for them. Throws Error if the camera has no software
  // trigger.
  virtual void UseSoftwareTrigger() {
    throw Error("this camera has no software trigger", info().id, "Record without --trigger");
  }
  // Asks for one frame. On the thread that calls Next.
  virtual void Trigger() {}

  virtual void Start(Progress& progress) = 0;
  // Waits at most `timeout`. Fills `frame`; its memory is used again. On kDamaged info.name says what is
  // wrong.
  virtual Delivery Next(Frame& frame, std::chrono::milliseconds timeout) = 0;
  virtual void Stop() = 0;
};

// The cameras that can be opened now. Never throws because one backend fails.
std::vector<CameraInfo> ListCameras();

// id: of a CameraInfo; a GigE or USB3 Vision camera also by its serial number or address. Throws
// NoSuchCamera, or Error if it cannot be used.
std::unique_ptr<Camera> OpenCamera(const std::string& id);

}  // namespace polarscan
