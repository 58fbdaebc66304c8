// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "acquisition/capture.h"
#include "acquisition/live_picture.h"

namespace polarscan {

// A recording as a web page on this machine: the latest frame as S0 (clipped cells in red), degree and angle
// of polarization, the numbers of the live line, and what to do about them. The page can ask for a shot and
// for the end.
//
// GET / the page; /state the numbers as JSON, with "picture", the number of the latest pictures; /s0.jpg,
// /dop.jpg, /aop.jpg, /wheel.jpg. POST /shot, /stop, with the header X-Polarscan (other sites' pages cannot
// send it).
class Preview {
 public:
  // port 0: any that is free. Throws Error if the port is taken.
  explicit Preview(int port);
  ~Preview();
  std::string address() const;  // "http://127.0.0.1:8417/"

  void Show(const nlohmann::json& state);
  void Look(const LivePicture& view);
  // What the page has asked for since the last call.
  CaptureHooks::Key Pressed();

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace polarscan
