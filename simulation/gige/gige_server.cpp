// SPDX-License-Identifier: Apache-2.0
#include "simulation/gige/gige_server.h"

#include <atomic>
#include <exception>
#include <thread>

#include "core/error.h"
#include "simulation/gige/control.h"
#include "simulation/gige/control_socket.h"
#include "simulation/gige/features.h"
#include "simulation/gige/stream.h"

namespace polarscan {
namespace {

constexpr auto kControlPoll = std::chrono::milliseconds(20);

}  // namespace

class GigeServer::Implementation {
 public:
  Implementation(GigeSource source, const std::string& address, const GigeServerOptions& options)
      : source_(std::move(source)),
        options_(options),
        registers_(IdentityOf(source_.camera, Ipv4Of(address)), FeaturesOf(source_)),
        sockets_(Ipv4Of(address)),
        sender_(Ipv4Of(address), options) {}

  void Run(Progress& progress) {
    sockets_.ForgetOldQuestions();
    std::thread stream([&] {
      try {
        stream_.Run(progress);
      } catch (const Cancelled&) {
      } catch (...) {
        failure_ = std::current_exception();
        failed_ = true;
      }
    });
    while (!progress.cancelled() && !failed_) Serve();
    stream_.Stop();
    stream.join();
    source_.camera.Stop();
    if (failure_) std::rethrow_exception(failure_);
  }

  Bytes Hear(ByteView datagram) { return control_.Hear(datagram, {}); }
  GigeCounts counts() const { return sender_.counts(); }

 private:
  void Serve() {
    sockets_.Serve(kControlPoll, [&](ByteView datagram, const sockaddr_in& from) {
      return control_.silent() ? Bytes() : control_.Hear(datagram, from);
    });
    control_.ForgetSilentController();
  }

  GigeSource source_;
  const GigeServerOptions options_;
  GigeRegisters registers_;
  ControlSockets sockets_;
  StreamSender sender_;
  GigeControl control_{registers_, sender_};
  GigeStream stream_{source_, options_, control_, sender_};
  std::atomic<bool> failed_ = false;
  std::exception_ptr failure_;
};

OptionTable Table(GigeServerOptions& o) {
  return {
      {"pace", &o.pace, "a frame is sent in this share of the time between two frames", "", 0, 1},
      {"packet-loss", &o.faults.loss, "share of the packets that get lost", "", 0, 1},
      {"packet-duplicates", &o.faults.duplicates, "share of the packets that come twice", "", 0, 1},
      {"freeze-at", &o.faults.freeze_at, "after this frame the camera is dead for --fault-time", "frame", 0,
       2e9},
      {"disconnect-at", &o.faults.disconnect_at, "the same, and then it has forgotten everything", "frame", 0,
       2e9},
      {"format-change-at", &o.faults.format_change_at, "frames are half as high from this one on", "frame", 0,
       2e9},
      {"short-at", &o.faults.short_at, "this frame ends after half of its packets", "frame", 0, 2e9},
      {"headless-at", &o.faults.headless_at, "this frame's leader never comes", "frame", 0, 2e9},
      {"packet-size", &o.faults.packet_size, "of the stream, whatever was agreed; 0: as agreed", "byte", 0,
       65000},
      {"clock-jump-at", &o.faults.clock_jump_at, "the camera's clock is an hour ahead from this one on",
       "frame", 0, 2e9},
      {"stray-packet", &o.faults.stray_packet, "a late test packet comes at the beginning of each stream"},
      {"first-number", &o.faults.first_number, "number of a stream's first frame, of 16 bits", "", 1, 65535},
      {"fault-time", &o.faults.fault_s, "of freeze and disconnect", "s", 0, 1e6},
  };
}

GigeServer::GigeServer(GigeSource source, const std::string& address, const GigeServerOptions& options)
    : implementation_(std::make_unique<Implementation>(std::move(source), address, options)) {}
GigeServer::~GigeServer() = default;
void GigeServer::Run(Progress& progress) { implementation_->Run(progress); }
Bytes GigeServer::Answer(ByteView datagram) { return implementation_->Hear(datagram); }
GigeCounts GigeServer::counts() const { return implementation_->counts(); }

}  // namespace polarscan
