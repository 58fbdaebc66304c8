// SPDX-License-Identifier: Apache-2.0
#include "simulation/simulator.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "simulation/scene/shapes.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kMaker = "polarscan simulate";
constexpr const char* kConvention =
    "Image axes x right, y down. S0=(I0+I45+I90+I135)/2, S1=I0-I90, S2=I45-I135; AoP=atan2(S2,S1)/2 "
    "anticlockwise as displayed from +x. Camera x right, y down, z forward; sparse holds cam_from_world; "
    "pixel centres at integer+0.5.";

// Makes room: an absent or empty folder, or one that the same simulation, by its set.json, filled before.
void PrepareFolder(const fs::path& folder, const json& set) {
  RequireFree(
      folder,
      [&] {
        const json found = ReadJson(folder / "set.json");
        return found.at("renderer") == kMaker && found.at("seed") == set.at("seed") &&
               found.at("options") == set.at("options");
      },
      "Choose a new folder with -o; only the same simulation is made again in its place");
  CreateFolder(folder);
  for (const char* part : {"mosaic", "masks", "sparse", "truth"}) fs::remove_all(folder / part);
}

json SensorJson(const SimulatedSensor& sensor) {
  return {{"full_well_e", sensor.full_well_e},
          {"read_noise_e", sensor.read_noise_e},
          {"black_dn", sensor.black_dn()},
          {"dn_per_e", sensor.dn_per_e()},
          {"max_dn", sensor.max_dn()},
          {"layout", ToString(sensor.layout)},
          {"bits", sensor.bits}};
}

json SetJson(const SimulatorOptions& options, const SimulatedSensor& sensor, const SimulationSummary& summary,
             bool complete) {
  SimulatorOptions copy = options;
  return {{"renderer", kMaker},           {"complete", complete},
          {"format", "mosaic"},           {"width", options.width},
          {"height", options.height},     {"views", summary.views},
          {"distance", summary.distance}, {"gain", summary.gain},
          {"seed", options.seed},         {"options", ToJson(Table(copy))},
          {"convention", kConvention},    {"sensor", SensorJson(sensor)}};
}

// Where the board lies and how large it is in the units of everything else in truth/.
json BoardJson(const Scene& scene) {
  const Board& board = StandardBoards()[0];
  const Similarity s = BoardFromWorld(scene);
  json rotation = json::array();
  for (int row = 0; row < 3; ++row)
    rotation.push_back({s.rotation(row, 0), s.rotation(row, 1), s.rotation(row, 2)});
  return {{"board", board.name},
          {"square_mm", board.square_mm},
          {"mm_per_unit", s.scale},
          {"board_from_world",
           {{"scale", s.scale},
            {"rotation", rotation},
            {"translation", {s.translation.x(), s.translation.y(), s.translation.z()}}}}};
}

void WriteTruth(const fs::path& folder, const Scene& scene, const Pinhole& camera,
                const std::vector<SimulatedPose>& views, bool known_poses) {
  WriteMesh(folder / "truth" / "mesh.ply", scene.object);
  if (scene.has_table) WriteMesh(folder / "truth" / "table.ply", TableMesh(scene));
  if (!scene.sheet.empty()) WriteJson(folder / "truth" / "board.json", BoardJson(scene));
  WriteTruePoses(folder / "truth" / "sparse", camera, views);
  if (known_poses) WriteTruePoses(folder / "sparse", camera, views);
}

OptionTable SceneTable(SceneOptions& scene) {
  return {
      {"scene", &scene.scene, "object to stand on the table", "", -1e300, 1e300, ShapeNames()},
      {"mesh", &scene.mesh,
       "PLY, STL or OBJ file of an object to use instead; it is scaled to bounding radius 1"},
      {"up", &scene.up, "axis of that file that points up", "", -1e300, 1e300, {"y", "z"}},
      {"texture",
       &scene.texture,
       "albedo of the object: even, faint on half of it, or plain to see",
       "",
       -1e300,
       1e300,
       {"none", "weak", "strong"}},
      {"albedo", &scene.albedo, "mean albedo of the object; darker is more polarized", "", 0.01, 0.95},
      {"roughness", &scene.roughness, "GGX roughness of the object's surface; 0 is a mirror", "", 0, 1},
      {"ior", &scene.ior, "index of refraction of the object", "", 1.05, 3},
      {"light", &scene.light, "surroundings that light the scene", "", -1e300, 1e300, EnvironmentNames()},
      {"table", &scene.table, "stand the object on a printed table, from which poses can be found"},
      {"print", &scene.print, "the table's print; without it the table is plain, and so are the blocks"},
      {"blocks", &scene.blocks,
       "printed blocks on the table; without them structure from motion sees a mere plane"},
      {"room", &scene.room, "a printed wall far behind the scene, all around"},
      {"board", &scene.board,
       "an A4 board (polarscan board) under the object; a unit of the scene is 60 mm then, and "
       "truth/board.json "
       "says where the board lies"},
  };
}

}  // namespace

OptionTable Table(SimulatorOptions& options) {
  OptionTable table = SceneTable(options.scene);
  const OptionTable camera = {
      {"rings", &options.rings, "cameras around the object as elevation:views, ..."},
      {"turntable", &options.turntable,
       "the scene turns before a camera, lamps and a room that stand still, one stand a ring"},
      {"width", &options.width, "raw picture width", "px", 16, 16384},
      {"height", &options.height, "raw picture height", "px", 16, 16384},
      {"fov", &options.fov_deg, "horizontal field of view", "deg", 5, 120},
      {"fill", &options.fill, "share of the half picture that the object reaches in its widest view", "", 0.1,
       1},
      {"jitter", &options.jitter_deg, "largest deviation of a camera from its place on the ring", "deg", 0,
       10},
      {"samples", &options.samples, "rays per raw pixel and axis; time grows with the square", "", 1, 8},
      {"layout", &options.layout, "polarizer angles of the 2x2 cell, row by row", "deg"},
      {"bits", &options.sensor.bits, "bit depth of the counts", "bit", 8, 16},
      {"full-well", &options.sensor.full_well_e, "electrons at saturation; fewer is noisier", "e-", 100, 1e6},
      {"read-noise", &options.sensor.read_noise_e, "standard deviation of the read noise", "e-", 0, 1000},
      {"black-level", &options.sensor.black_share, "black level as a share of the largest count", "", 0, 0.5},
      {"noise", &options.sensor.noise, "shot and read noise"},
      {"exposure", &options.exposure, "1: the brightest 0.5 % of the scene clips; 2: twice as long", "",
       0.001, 1000},
      {"masks", &options.masks, "write masks/ of the object"},
      {"known-poses", &options.known_poses, "write sparse/, so that structure from motion is not needed"},
  };
  table.insert(table.end(), camera.begin(), camera.end());
  return table;
}

Pinhole SimulatedPinhole(const SimulatorOptions& options) {
  const double focal = 0.5 * options.width / std::tan(0.5 * options.fov_deg * std::numbers::pi / 180);
  return {options.width, options.height, focal, focal, 0.5 * options.width, 0.5 * options.height};
}

SimulatedShoot PrepareShoot(Scene scene, const SimulatorOptions& options, Progress& progress) {
  const std::vector<CameraRing> rings = ParseRings(options.rings);
  progress.Begin("lighting the scene", 1, "scene");
  LitScene lit = Illuminate(std::move(scene), progress);
  progress.Advance();
  const Pinhole camera = SimulatedPinhole(options);
  std::vector<SimulatedPose> views = RingViews(rings, options.jitter_deg, options.seed, lit.scene.object,
                                               camera, options.fill, options.turntable);
  const double gain = options.exposure * AutomaticGain(lit, camera, views, progress);
  return {std::move(lit), camera, std::move(views), gain};
}

Image<std::uint16_t> TakePicture(const SimulatedShoot& shoot, const SimulatedPose& view,
                                 const FrameSettings& settings, Progress& progress) {
  if (view.turn_rad == shoot.lit.scene.turn_rad)
    return RenderFrame(shoot.lit, shoot.camera, view.cam_from_world, settings, progress);
  Scene turned = shoot.lit.scene;
  turned.turn_rad = view.turn_rad;
  return RenderFrame(Illuminate(std::move(turned), progress), shoot.camera, view.cam_from_world, settings,
                     progress);
}

namespace {

SimulationSummary Write(const SimulatorOptions& options, bool pictures, const fs::path& folder,
                        Progress& progress) {
  SimulatorOptions effective = options;
  Validate(Table(effective));
  effective.scene.seed = options.seed;
  FrameSettings settings{options.sensor, options.samples, 1, options.seed, 0};
  settings.sensor.layout = ParseLayout(options.layout);
  if (options.width % 2 != 0 || options.height % 2 != 0)
    throw Error("a mosaic consists of whole 2x2 cells", fmt::format("{}x{}", options.width, options.height),
                "Choose an even --width and --height");
  ParseRings(options.rings);  // what is wrong with the options shows before the folder is touched
  Scene scene = MakeScene(effective.scene, progress);
  const json set = SetJson(options, settings.sensor, {}, false);
  PrepareFolder(folder, set);
  WriteJson(folder / "set.json", set);

  const SimulatedShoot shoot = PrepareShoot(std::move(scene), options, progress);
  settings.gain = shoot.gain;
  const auto& [lit, camera, views, gain] = shoot;
  WriteTruth(folder, lit.scene, camera, views, options.known_poses);

  if (pictures) {
    progress.Begin(views.size() == 1 ? "taking a picture" : fmt::format("taking {} pictures", views.size()),
                   views.size() * std::size_t(camera.height), "row");
  } else {
    progress.Begin("writing the truth", views.size());
  }
  for (const SimulatedPose& view : views) {
    const std::string file = view.name + ".png";
    if (pictures) WritePng(folder / "mosaic" / file, TakePicture(shoot, view, settings, progress));
    if (options.masks)
      WritePng(folder / "masks" / file, RenderMask(lit, camera, view.cam_from_world, progress));
    ++settings.frame;
    if (!pictures) progress.Advance();
  }
  const SimulationSummary summary{int(views.size()), settings.gain, views[0].cam_from_world.translation.z()};
  WriteJson(folder / "set.json", SetJson(options, settings.sensor, summary, true));
  return summary;
}

}  // namespace

SimulationSummary Simulate(const SimulatorOptions& options, const fs::path& folder, Progress& progress) {
  return Write(options, true, folder, progress);
}

void SimulateTruth(const SimulatorOptions& options, const fs::path& folder, Progress& progress) {
  Write(options, false, folder, progress);
}

}  // namespace polarscan
