// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <chrono>

#include "simulation/gige/control.h"
#include "simulation/gige/gige_server.h"
#include "simulation/gige/stream_sender.h"

namespace polarscan {

// Takes frames from the source while the controller wants them and gives them to the sender, with what goes
// wrong on purpose. One thread runs it; Stop belongs to another.
class GigeStream {
 public:
  // All four are kept as references.
  GigeStream(GigeSource& source, const GigeServerOptions& options, GigeControl& control, StreamSender& sender)
      : source_(source), options_(options), control_(control), sender_(sender) {}

  // Until Stop. Throws what the source throws.
  void Run(Progress& progress);
  void Stop() { stop_ = true; }

 private:
  void StartSource(Progress& progress);
  void SendNext(Frame& frame);
  void SendFrame(const Frame& frame);
  OutgoingFrame Outgoing(const Frame& frame, const StreamSettings& settings) const;
  void DoFaults();

  GigeSource& source_;
  const GigeServerOptions& options_;
  GigeControl& control_;
  StreamSender& sender_;
  std::atomic<bool> stop_ = false;
  std::chrono::duration<double> period_{1};
  std::uint16_t block_ = 0;  // number of the last frame
  std::uint64_t sent_ = 0;   // frames, through the server's life
};

}  // namespace polarscan
