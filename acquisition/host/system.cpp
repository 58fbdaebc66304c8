// SPDX-License-Identifier: Apache-2.0
#include "acquisition/host/system.h"

#include <fmt/format.h>
#include <sys/timex.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

namespace polarscan {
namespace fs = std::filesystem;
namespace {

constexpr long kOpenFiles = 1024;

// {name: soft limit} of this program, as the kernel writes it: a number or "unlimited".
std::map<std::string, std::string> Limits(const Host& host) {
  constexpr std::size_t kNameWidth = 26;
  std::map<std::string, std::string> limits;
  std::ifstream file(host.proc / "self/limits");
  for (std::string line; std::getline(file, line);) {
    if (line.size() <= kNameWidth) continue;
    std::string name = line.substr(0, kNameWidth);
    name.erase(name.find_last_not_of(' ') + 1);
    std::istringstream(line.substr(kNameWidth)) >> limits[name];
  }
  return limits;
}

std::vector<std::string> VideoDevices(const Host& host) {
  std::vector<std::string> nodes;
  std::error_code missing;
  for (const auto& entry : fs::directory_iterator(host.dev, missing))
    if (entry.path().filename().string().starts_with("video")) nodes.push_back(entry.path());
  std::ranges::sort(nodes);
  return nodes;
}

}  // namespace

HostCheck CheckCameras(const std::vector<CameraInfo>& cameras) {
  HostCheck check{"cameras", CheckState::kGood, "", "", ""};
  for (const CameraInfo& camera : cameras)
    if (camera.id != "simulated") check.measured += (check.measured.empty() ? "" : ", ") + camera.id;
  if (check.measured.empty()) {
    check.state = CheckState::kNotApplicable;
    check.measured = "none can be opened; without one there is the simulated camera";
    check.fix = "polarscan capture --camera simulated -o SESSION --seconds 10";
  }
  return check;
}

std::vector<HostCheck> CheckVideoDevices(const Host& host) {
  const std::vector<std::string> nodes = VideoDevices(host);
  if (nodes.empty()) return {{"video devices", CheckState::kNotApplicable, "there are none", "", ""}};
  std::vector<HostCheck> checks;
  for (const std::string& node : nodes)
    if (!MayUse(node))
      checks.push_back({"video device " + node, CheckState::kWarning, "not yours to use",
                        "to read and write it",
                        "sudo usermod -aG video $USER   (then log out and in again)"});
  if (checks.empty()) checks.push_back({"video devices", CheckState::kGood, "yours to use", "", ""});
  return checks;
}

HostCheck CheckLimits(const Host& host) {
  std::map<std::string, std::string> limits = Limits(host);
  const std::string files = limits["Max open files"];
  if (files.empty()) return {"limits", CheckState::kNotApplicable, "not known", "", ""};
  HostCheck check{"limits", CheckState::kGood,
                  fmt::format("open files {}, locked memory {}, real-time priority {}", files,
                              limits["Max locked memory"], limits["Max realtime priority"]),
                  fmt::format("{} open files; the others are not used", kOpenFiles), ""};
  if (files != "unlimited" && std::atol(files.c_str()) < kOpenFiles) {
    check.state = CheckState::kWarning;
    check.fix = fmt::format("ulimit -n {}", kOpenFiles);
  }
  return check;
}

HostCheck CheckClock(int state, const timex& clock) {
  if (state < 0) return {"clock", CheckState::kNotApplicable, "not known", "", ""};
  HostCheck check{"clock", CheckState::kGood,
                  fmt::format("synchronised, to {:.0f} ms or better", double(clock.maxerror) / 1000), "", ""};
  if (state == TIME_ERROR || (clock.status & STA_UNSYNC)) {
    check.state = CheckState::kWarning;
    check.measured = "not synchronised";
    check.required = "synchronised, so that times of recordings mean something";
    check.fix = "sudo apt install systemd-timesyncd && sudo timedatectl set-ntp true";
  }
  return check;
}

HostCheck CheckClock() {
  timex clock{};
  const int state = ::ntp_adjtime(&clock);
  return CheckClock(state, clock);
}

}  // namespace polarscan
