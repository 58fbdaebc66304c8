// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "acquisition/camera/replay_camera.h"
#include "acquisition/session/session_reader.h"
#include "apps/command.h"
#include "core/error.h"
#include "simulation/gige/gige_server.h"
#include "simulation/simulated_camera.h"

namespace polarscan {
namespace {

struct SimulateArguments {
  SimulatedCameraOptions options;
  GigeServerOptions gige;
  std::string folder, address;
};

// What a camera needs more than a folder of pictures.
OptionTable CameraOnly(SimulatedCameraOptions& options) {
  const OptionTable of_pictures = Table(options.simulator);
  OptionTable table = Table(options);
  std::erase_if(table, [&](const Option& row) {
    return std::ranges::find(of_pictures, row.name, &Option::name) != of_pictures.end();
  });
  return table;
}

// prepare: what is to be done before frames can come, once the address is known to be free.
void Serve(
    GigeSource source, const std::string& address, const GigeServerOptions& options, Context& context,
    const std::function<void()>& prepare = [] {}) {
  Camera& camera = source.camera;
  GigeServer server(std::move(source), address, options);
  DoWhole("the camera was not ready yet", [&] {
    prepare();
    camera.Start(context.progress);  // who finds the camera gets frames at once
  });
  context.progress.Info(fmt::format(
      "GigE Vision camera at {}, until Ctrl-C; polarscan capture --camera {} records it", address, address));
  server.Run(context.progress);
  const GigeCounts counts = server.counts();
  context.Finish({{"frames", counts.frames},
                  {"packets", counts.packets},
                  {"lost_packets", counts.lost},
                  {"resent_packets", counts.resent},
                  {"unavailable_packets", counts.unavailable}},
                 fmt::format("{} frames sent, {} packets, {} of them again", counts.frames, counts.packets,
                             counts.resent));
}

void ServeSimulated(SimulateArguments& a, Context& context) {
  const std::unique_ptr<Camera> camera = OpenSimulatedCamera(a.options);
  std::vector<std::string> formats = {a.options.pixel_format};
  for (const char* name : {"Mono8", "Mono10", "Mono12", "Mono16", "Mono10p", "Mono12p", "Mono12Packed"})
    if (name != a.options.pixel_format) formats.push_back(name);
  const auto configure = [&camera](const std::string& format, double frames_per_s) {
    camera->Set("pixel-format", format);
    camera->Set("fps", fmt::format("{}", frames_per_s));
  };
  const auto prepare = [&] {
    if (!a.folder.empty()) SimulateTruth(a.options.simulator, a.folder, context.progress);
    context.progress.Info("its polarizer layout is " + a.options.simulator.layout);
  };
  Serve({*camera, a.options.simulator.width, a.options.simulator.height, formats, a.options.fps, configure},
        a.address, a.gige, context, prepare);
}

void WritePictures(const SimulateArguments& a, Context& context) {
  DoWhole("the folder is not complete, and the same command begins it anew", [&] {
    const SimulationSummary summary = Simulate(a.options.simulator, a.folder, context.progress);
    context.Finish({{"views", summary.views}, {"folder", a.folder}, {"gain", summary.gain}},
                   fmt::format("{} pictures and their truth in {}", summary.views, a.folder));
  });
}

struct ReplayArguments {
  std::string session, address = "127.0.0.1";
  double speed = 1;
  GigeServerOptions gige;
};

// At the pace of the recording.
void ServeReplay(const ReplayArguments& a, Context& context) {
  const Session session = OpenSession(a.session, Verify::kHeaders, context.progress);
  if (session.frames.empty()) throw Error("there are no frames in this session", a.session);
  const FrameInfo &first = session.frames.front().info, &last = session.frames.back().info;
  const double seconds = double(last.host_time_ns - first.host_time_ns) * 1e-9;
  const double rate = seconds > 0 ? a.speed * double(session.frames.size() - 1) / seconds : 1;
  const std::unique_ptr<Camera> camera = OpenReplayCamera(a.session);
  camera->Set("speed", fmt::format("{}", a.speed));
  Serve({*camera, first.width, first.height, {first.pixel_format}, rate, [](const std::string&, double) {}},
        a.address, a.gige, context);
}

}  // namespace

void AddSimulateCommand(CLI::App& app, Context& context) {
  auto a = std::make_shared<SimulateArguments>();
  CLI::App* command = app.add_subcommand(
      "simulate", "A simulated camera: pictures of a made-up scene, or a GigE Vision camera");
  command->add_option(
      "-o,--output", a->folder,
      "Folder for the pictures and the truth beside them; with --gige only for truth and masks");
  command
      ->add_option("--gige", a->address,
                   "Be a GigE Vision camera at this address of this machine, say 127.0.0.1")
      ->type_name("ADDRESS");
  AddOptions(*command, Table(a->options.simulator), "Scene and sensor, for studies");
  AddOptions(*command, CameraOnly(a->options),
             "As a camera (--gige), for who tries a recording and its faults");
  AddOptions(*command, Table(a->gige), "As a camera (--gige), for who tries a recording and its faults");
  ShowFirst(*command, {"scene", "mesh", "rings", "width", "height", "samples", "texture", "table", "masks",
                       "known-poses"});
  AddExample(
      *command,
      "  polarscan simulate -o pictures --scene vase --width 640 --height 512\n"
      "  polarscan simulate --gige 127.0.0.1       (records with: polarscan capture --camera 127.0.0.1)");
  command->callback([a, &context] {
    if (a->folder.empty() && a->address.empty()) throw CLI::RequiredError("-o FOLDER or --gige ADDRESS");
    a->options.simulator.seed = a->options.simulator.scene.seed = a->gige.seed = context.seed;
    a->address.empty() ? WritePictures(*a, context) : ServeSimulated(*a, context);
  });
}

void AddReplayCommand(CLI::App& app, Context& context) {
  auto a = std::make_shared<ReplayArguments>();
  CLI::App* command =
      app.add_subcommand("replay", "A recording plays the camera: a GigE Vision camera on this machine");
  command->add_option("SESSION", a->session, "A session")->required()->check(IsFolder());
  command->add_option("--gige", a->address, "Address of this machine")
      ->type_name("ADDRESS")
      ->capture_default_str();
  command->add_option("--speed", a->speed, "2: twice as fast")
      ->check(IsBetween(0.001, 1000.0))
      ->capture_default_str();
  AddOptions(*command, Table(a->gige), "As a camera, for who tries a recording and its faults");
  AddExample(*command, "  polarscan replay session --speed 2");
  command->callback([a, &context] {
    a->gige.seed = context.seed;
    ServeReplay(*a, context);
  });
}

}  // namespace polarscan
