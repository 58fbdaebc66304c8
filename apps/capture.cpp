// SPDX-License-Identifier: Apache-2.0
#include "acquisition/capture.h"

#include <fmt/ranges.h>
#include <unistd.h>

#include <chrono>
#include <future>
#include <map>
#include <optional>
#include <thread>

#include "acquisition/input/input.h"
#include "acquisition/session/session_writer.h"
#include "apps/command.h"
#include "apps/live/capture_screen.h"
#include "core/words.h"
#include "simulation/cameras.h"

namespace polarscan {
namespace {

struct CaptureArguments {
  std::string session, camera;
  std::vector<std::string> features;
  double wait_s = 0;
  bool preview = false;
  int preview_port = 8417;
  CaptureOptions options;
  InputOptions sensor;
};

// What a camera may not say about itself, by the options' names and their keys in "sensor".
const std::map<std::string, std::string> kSensorKeys = {
    {"layout", "layout"}, {"black-level", "black_dn"},    {"white-level", "white_dn"},
    {"gain", "dn_per_e"}, {"read-noise", "read_noise_e"}, {"calibration", "calibration"}};

OptionTable SensorTable(InputOptions& options) {
  OptionTable table = Table(options);
  std::erase_if(table, [](const Option& row) { return !kSensorKeys.contains(row.name); });
  return table;
}

nlohmann::json GivenSensor(const CLI::App& command, InputOptions& options) {
  nlohmann::json sensor = nlohmann::json::object();
  const nlohmann::json given = GivenOptions(command, SensorTable(options));
  for (const auto& [name, value] : given.items()) sensor[kSensorKeys.at(name)] = value;
  if (sensor.contains("layout")) sensor["layout"] = ToString(ParseLayout(sensor["layout"]));
  if (sensor.contains("calibration"))
    sensor["calibration"] =
        ReadCalibration(std::filesystem::absolute(sensor["calibration"].get<std::string>())).folder.string();
  return sensor;
}

// What asks devices and takes its time, on a thread of its own, so that Ctrl-C need not wait for it: the
// thread then goes on until the program ends. ask: keeps all that it needs.
template <class Ask>
auto WhileListening(const Progress& progress, Ask ask) {
  auto task = std::make_shared<std::packaged_task<decltype(ask())()>>(std::move(ask));
  auto answer = task->get_future();
  std::thread([task] { (*task)(); }).detach();
  while (answer.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) progress.Check();
  return answer.get();
}

// The one real camera there is.
std::string PickCamera() {
  std::string id, list;
  for (const CameraInfo& camera : ListAllCameras()) {
    if (camera.id == "simulated") continue;
    id = camera.id;
    list += (list.empty() ? "" : ", ") + camera.id;
  }
  if (id.empty())
    throw Error("no camera was found", "GigE Vision, USB3 Vision, V4L2",
                "Try --camera simulated, or --camera replay:SESSION");
  if (id != list) throw Error("there are several cameras", list, "Say which: --camera " + id);
  return id;
}

// What could be meant instead.
std::string CamerasThereAre(const std::string& id, const Progress& progress) {
  std::vector<std::string> ids;
  for (const CameraInfo& camera : WhileListening(progress, ListAllCameras)) ids.push_back(camera.id);
  const std::string nearest = NearestName(id, ids);
  return fmt::format("{}There are {}, replay:SESSION",
                     nearest.empty() ? "" : "Did you mean " + nearest + "? ", fmt::join(ids, ", "));
}

// A camera that is not there yet is looked for until a.wait_s have passed.
std::unique_ptr<Camera> FindCamera(const CaptureArguments& a, const Context& context) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(a.wait_s);
  while (true) {
    try {
      return WhileListening(context.progress, [id = a.camera, seed = context.seed] {
        return OpenAnyCamera(id.empty() ? PickCamera() : id, seed);
      });
    } catch (const NoSuchCamera&) {
      if (Clock::now() >= end)
        throw NoSuchCamera("there is no such camera now", a.camera,
                           CamerasThereAre(a.camera, context.progress));
    } catch (const Error&) {
      if (Clock::now() >= end) throw;
    }
    context.progress.Check();
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
}

void SetFeatures(Camera& camera, const std::vector<std::string>& features) {
  for (const std::string& feature : features) {
    const std::size_t equals = feature.find('=');
    if (equals == std::string::npos || equals == 0)
      throw Error("a feature is set as Name=Value", "--set " + feature, "Say --set ExposureTime=20000");
    camera.Set(feature.substr(0, equals), feature.substr(equals + 1));
  }
}

void Run(const CaptureArguments& a, const nlohmann::json& sensor, Context& context) {
  RequireNewSessionFolder(a.session);
  const std::unique_ptr<Camera> camera = FindCamera(a, context);
  SetFeatures(*camera, a.features);
  nlohmann::json known = camera->sensor();
  known.update(sensor);
  std::optional<Preview> preview;
  if (a.preview) {
    preview.emplace(a.preview_port);
    context.progress.Info("preview at " + preview->address());
  }
  CaptureScreen screen(context.progress, a.session, a.options.on_key, preview ? &*preview : nullptr);
  std::optional<Keyboard> keyboard;
  CaptureHooks hooks;
  hooks.status = [&](const CaptureStatus& status) { screen.Show(status); };
  hooks.look = [&](const Frame& frame, const nlohmann::json& s) { screen.Look(frame, s); };
  if (!known.contains("layout"))
    context.progress.Warn(
        "the camera does not tell its polarizer layout; give it with --layout, now or to reconstruct "
        "(docs/input.md)");
  if (a.options.on_key) {
    if (!preview || isatty(STDIN_FILENO)) keyboard.emplace();
    context.progress.Info("space takes a shot, q ends");
  }
  hooks.key = [&] {
    const CaptureHooks::Key key = keyboard ? keyboard->Pressed() : CaptureHooks::Key::kNone;
    return key == CaptureHooks::Key::kNone && preview ? preview->Pressed() : key;
  };
  const CaptureStatus status = Capture(*camera, a.session, sensor, a.options, hooks, context.progress);
  context.data_lost = status.counts.lost + status.counts.dropped > 0;
  nlohmann::json result = ToJson(status.counts);
  result.update({{"session", a.session}, {"seconds", status.seconds}, {"shots", status.shots}});
  context.Finish(result, fmt::format("{} in {}", Describe(status.counts), a.session));
}

std::string Describe(const CameraInfo& camera) {
  return fmt::format("{}  {} {} {}", camera.id, camera.vendor, camera.model, camera.serial);
}

std::map<std::string, std::string> CamerasNow(const Progress& progress) {
  std::map<std::string, std::string> cameras;
  for (const CameraInfo& camera : WhileListening(progress, ListAllCameras))
    cameras[camera.id] = Describe(camera);
  return cameras;
}

// Says what is plugged in and out, until Ctrl-C.
void WatchCameras(Context& context) {
  const auto differences = [&](const auto& before, const auto& now, const char* what) {
    for (const auto& [id, text] : now)
      if (!before.contains(id)) context.progress.Info(fmt::format("{} {}", what, text));
  };
  std::map<std::string, std::string> before;
  while (!context.progress.cancelled()) {
    std::map<std::string, std::string> now;
    try {
      now = CamerasNow(context.progress);
    } catch (const Cancelled&) {
      return;
    }
    differences(before, now, "here:");
    differences(now, before, "gone:");
    before = now;
    for (int i = 0; i < 10 && !context.progress.cancelled(); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
}

}  // namespace

void AddCaptureCommand(CLI::App& app, Context& context) {
  auto a = std::make_shared<CaptureArguments>();
  CLI::App* command = app.add_subcommand("capture", "Record a camera into a session; Ctrl-C ends it");
  command->add_option("-o,--output", a->session, "The session's folder, new or empty")
      ->required()
      ->type_name("SESSION");
  command->add_option("--camera", a->camera, "As polarscan cameras lists them; not needed where there is one")
      ->type_name("ID");
  command->add_option("--set", a->features, "Sets a feature of the camera, before recording; may be repeated")
      ->type_name("Name=Value")
      ->allow_extra_args(false);
  command->add_option("--wait", a->wait_s, "Look for the camera this long, where it is not there yet, in s")
      ->check(IsBetween(0.0, 1e9));
  command->add_flag("--preview", a->preview,
                    "Show the pictures and the numbers in a web page on this machine");
  command->add_option("--preview-port", a->preview_port, "Of that page; 0: any that is free")
      ->check(IsBetween(0, 65535))
      ->capture_default_str();
  AddOptions(*command, Table(a->options), "Recording");
  AddOptions(*command, SensorTable(a->sensor), "What the camera does not say");
  ShowFirst(*command, {"frames", "seconds", "every", "on-key", "layout"});
  AddExample(*command,
             "  polarscan capture -o session --preview --layout \"90 45 / 135 0\"\n"
             "  polarscan capture -o session --camera 192.168.1.20 --on-key    (a turntable)");
  command->callback([a, command, &context] {
    DoWhole("the recording had not begun", [&] { Run(*a, GivenSensor(*command, a->sensor), context); });
  });
}

void AddCamerasCommand(CLI::App& app, Context& context) {
  CLI::App* command = app.add_subcommand("cameras", "List the cameras that can be opened");
  auto watch = std::make_shared<bool>(false);
  AddExample(*command, "  polarscan cameras --watch");
  command->add_flag("--watch", *watch, "Say which come and go, until Ctrl-C");
  command->callback([watch, &context] {
    if (*watch) return WatchCameras(context);
    nlohmann::json list = nlohmann::json::array();
    std::string text;
    std::vector<CameraInfo> cameras;
    DoWhole("the cameras are not known yet",
            [&] { cameras = WhileListening(context.progress, ListAllCameras); });
    for (const CameraInfo& camera : cameras) {
      list.push_back(ToJson(camera));
      text += (text.empty() ? "" : "\n") + Describe(camera);
    }
    context.Finish({{"cameras", list}}, text);
  });
}

}  // namespace polarscan
