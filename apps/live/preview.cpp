// SPDX-License-Identifier: Apache-2.0
#include "apps/live/preview.h"

#include <fmt/format.h>
#include <httplib.h>
#undef _res  // a macro of <resolv.h> that Eigen stumbles over

#include <atomic>
#include <cmath>
#include <mutex>
#include <thread>

#include "core/error.h"
#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "demosaic/false_colour.h"
#include "report/pages.h"
#include "report/pictures.h"

namespace polarscan {
namespace {

constexpr const char* kHost = "127.0.0.1";
constexpr int kJpegQuality = 85, kWheelSize = 96;
constexpr Rgb8 kClipped{230, 30, 30};

// By the sensor's full scale, not by the picture's, so that it looks dark when it is dark.
Image<Rgb8> S0Picture(const StokesImage& view) {
  Image<Rgb8> picture(view.s0.width(), view.s0.height(), kClipped);
  for (std::size_t i = 0; i < picture.size(); ++i) {
    if (!std::isfinite(view.noise.pixels()[i])) continue;
    const float level = std::clamp(view.s0.pixels()[i] / 2, 0.f, 1.f);
    const auto grey = std::uint8_t(std::lround(255 * std::pow(level, 1 / 2.2)));
    picture.pixels()[i] = {grey, grey, grey};
  }
  return picture;
}

}  // namespace

class Preview::Implementation {
 public:
  explicit Implementation(int port) {
    AddPages();
    AddKeys();
    // httplib's own choice lets two programs listen at the same port.
    server_.set_socket_options([](socket_t socket) {
      const int on = 1;
      ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    });
    const bool bound =
        port > 0 ? server_.bind_to_port(kHost, port) : (port = server_.bind_to_any_port(kHost)) > 0;
    if (!bound)
      throw Error("the preview's port is taken", std::to_string(port), "Give another with --preview-port");
    address_ = fmt::format("http://{}:{}/", kHost, port);
    thread_ = std::thread([this] { server_.listen_after_bind(); });
  }
  ~Implementation() {
    server_.stop();
    thread_.join();
  }

  const std::string& address() const { return address_; }

  void Show(const nlohmann::json& state) {
    const std::lock_guard lock(mutex_);
    state_ = state;
  }

  void Look(const LivePicture& view) {
    std::vector<double> dop;
    AppendDop(view.stokes, dop);
    const double full = DopFullScale(dop);
    std::map<std::string, std::string> pictures = {
        {"s0", EncodeJpeg(S0Picture(view.stokes), kJpegQuality)},
        {"dop", EncodeJpeg(DopPicture(view.stokes, float(full)), kJpegQuality)},
        {"aop", EncodeJpeg(AopPicture(view.stokes, float(full)), kJpegQuality)}};
    const std::lock_guard lock(mutex_);
    pictures_ = std::move(pictures);
    dop_full_ = full;
    ++picture_;
  }

  CaptureHooks::Key Pressed() { return key_.exchange(CaptureHooks::Key::kNone); }

 private:
  using Request = httplib::Request;
  using Response = httplib::Response;

  void AddPages() {
    server_.Get("/", [](const Request&, Response& answer) { answer.set_content(kPreviewHtml, "text/html"); });
    server_.Get("/state", [this](const Request&, Response& answer) {
      const std::lock_guard lock(mutex_);
      nlohmann::json state = state_;
      state["picture"] = picture_;
      state["dop_full"] = dop_full_;
      answer.set_content(ToText(state), "application/json");
    });
    server_.Get("/wheel.jpg", [](const Request&, Response& answer) {
      answer.set_content(EncodeJpeg(AopWheel(kWheelSize), kJpegQuality), "image/jpeg");
    });
    server_.Get(R"(/(s0|dop|aop)\.jpg)", [this](const Request& request, Response& answer) {
      const std::lock_guard lock(mutex_);
      const auto picture = pictures_.find(request.matches[1]);
      if (picture == pictures_.end()) {
        answer.status = 404;
      } else {
        answer.set_content(picture->second, "image/jpeg");
      }
    });
    server_.set_default_headers({{"Cache-Control", "no-store"}});
  }

  void AddKeys() {
    const auto add = [this](const char* path, CaptureHooks::Key key) {
      server_.Post(path, [this, key](const Request& request, Response& answer) {
        if (request.has_header("X-Polarscan")) {
          key_ = key;
        } else {
          answer.status = 403;
        }
      });
    };
    add("/shot", CaptureHooks::Key::kShot);
    add("/stop", CaptureHooks::Key::kQuit);
  }

  httplib::Server server_;
  std::string address_;
  std::mutex mutex_;  // of the next lines
  nlohmann::json state_ = nlohmann::json::object();
  std::map<std::string, std::string> pictures_;
  double dop_full_ = 1;
  std::uint64_t picture_ = 0;
  std::atomic<CaptureHooks::Key> key_ = CaptureHooks::Key::kNone;
  std::thread thread_;
};

Preview::Preview(int port) : implementation_(std::make_unique<Implementation>(port)) {}
Preview::~Preview() = default;
std::string Preview::address() const { return implementation_->address(); }
void Preview::Show(const nlohmann::json& state) { implementation_->Show(state); }
void Preview::Look(const LivePicture& view) { implementation_->Look(view); }
CaptureHooks::Key Preview::Pressed() { return implementation_->Pressed(); }

}  // namespace polarscan
