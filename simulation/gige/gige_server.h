// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <memory>
#include <span>

#include "acquisition/camera/camera.h"
#include "core/options.h"

namespace polarscan {

// Whose frames are sent, and what a client may choose.
struct GigeSource {
  Camera& camera;
  int width = 0, height = 0;               // px
  std::vector<std::string> pixel_formats;  // the one at the beginning is first
  double frames_per_s = 0;
  // Called before Camera::Start with what the client has chosen.
  std::function<void(const std::string& pixel_format, double frames_per_s)> configure;
};

// What goes wrong, on purpose. Frames are counted from 1 through the server's life; 0: never.
struct GigeFaults {
  double loss = 0, duplicates = 0;  // shares of the stream's packets; a packet sent again may be lost again
  int freeze_at = 0;                // nothing is sent or answered for fault_s
  int disconnect_at = 0;            // the same, and the camera has forgotten everything after it
  int format_change_at = 0;         // frames are half as high from this one on
  int short_at = 0;                 // this frame ends after half of its packets
  int headless_at = 0;              // this frame's leader never comes
  int packet_size = 0;              // of the stream, whatever was agreed; 0: as agreed
  int clock_jump_at = 0;            // the camera's clock is an hour ahead from this one on
  bool stray_packet = false;        // a test packet comes when a stream has begun
  int first_number = 1;             // of a stream's frames; near 65535 the numbers soon begin anew
  double fault_s = 3;
};

struct GigeServerOptions {
  double pace = 0.7;  // a frame is sent in this share of the time between two
  std::uint64_t seed = 0;
  GigeFaults faults;
};
OptionTable Table(GigeServerOptions& options);

struct GigeCounts {
  std::uint64_t frames = 0, packets = 0, lost = 0, resent = 0, unavailable = 0;
};

// A GigE Vision camera on this machine that sends the frames of another Camera: GVCP on port 3956 of an
// address, GVSP to whoever is in control (GigE Vision 2.0). Frame numbers have 16 bits, as on most cameras.
// Packet resend, test packets, heartbeat, inter-packet delay, chunk data (kGigeChunks in registers.h).
class GigeServer {
 public:
  // address: IPv4, e.g. "127.0.0.1". Throws Error if it cannot be bound (another camera is there already, it
  // is another machine's). The source may be started after this, before Run.
  GigeServer(GigeSource source, const std::string& address, const GigeServerOptions& options);
  ~GigeServer();
  // Serves until progress is cancelled. Throws what the source throws.
  void Run(Progress& progress);
  // What it answers to a datagram on its control port, and does; empty: nothing.
  std::vector<std::uint8_t> Answer(std::span<const std::uint8_t> datagram);
  GigeCounts counts() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace polarscan
