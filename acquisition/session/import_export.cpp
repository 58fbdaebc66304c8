// SPDX-License-Identifier: Apache-2.0
#include "acquisition/session/import_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "acquisition/camera/camera.h"
#include "acquisition/input/masks.h"
#include "acquisition/session/session_views.h"
#include "acquisition/session/session_writer.h"
#include "core/error.h"
#include "core/files/files.h"
#include "demosaic/sensor/pixel_format.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;
constexpr std::uint64_t kSegmentBytes = 2'000'000'000;
constexpr float kAnglesBlack_dn = 4096, kAnglesWhite_dn = 65535;

PixelFormat FormatFor(const Sensor& sensor) {
  std::string family = "Mono";
  for (const char* bayer : {"RG", "GR", "GB", "BG"})
    if (ParsePixelFormat(fmt::format("Bayer{}8", bayer)).bayer == sensor.layout.bayer)
      family = std::string("Bayer") + bayer;
  for (const int bits : {8, 10, 12, 14})
    if (sensor.bits <= bits) return ParsePixelFormat(family + std::to_string(bits));
  return ParsePixelFormat(family + "16");
}

Frame FrameOf(const LoadedView& view, std::size_t picture, const PixelFormat& format, std::uint64_t sequence,
              std::uint64_t shot) {
  const Image<float>& plane = view.pictures[picture].planes[0];
  Image<std::uint16_t> counts(plane.width(), plane.height());
  for (std::size_t i = 0; i < counts.size(); ++i) counts.pixels()[i] = std::uint16_t(plane.pixels()[i]);
  Frame frame;
  frame.info.sequence = sequence, frame.info.shot = shot;
  if (!view.exposures.empty()) frame.info.exposure_us = view.exposures[picture];
  frame.info.name = view.name;
  frame.info.pixel_format = format.name;
  frame.info.width = counts.width(), frame.info.height = counts.height();
  frame.payload = Pack(format, counts);
  return frame;
}

// What lies beside pictures comes along.
void CopyMasksAndPoses(const fs::path& from, const fs::path& to) {
  for (const char* part : {"masks", "sparse"})
    if (fs::is_directory(from / part)) fs::copy(from / part, to / part, fs::copy_options::recursive);
}

// The mask of a view that comes from elsewhere than masks/, as its picture's transparency or beside it.
void WriteMaskOf(const LoadedView& loaded, const InputView& view, const fs::path& folder) {
  const bool comes_along = view.mask && view.mask->parent_path().filename() == "masks";
  if (!loaded.mask.empty() && !comes_along) WritePng(folder / "masks" / (view.name + ".png"), loaded.mask);
}

// Masks under the names that the pictures of a view's frames get; poses have no such names.
void CopyMasks(const Session& session, const std::map<std::string, std::vector<std::string>>& names,
               const fs::path& folder, Progress& progress) {
  Input input;
  input.folder = session.folder;
  for (const auto& [view, pictures] : names) input.views.push_back({view, {}});
  FindMasks(input);
  for (const InputView& view : input.views)
    for (const std::string& name : names.at(view.name))
      if (view.mask) {
        CreateFolder(folder / "masks");
        fs::copy_file(*view.mask, folder / "masks" / (name + view.mask->extension().string()));
      }
  if (fs::is_directory(session.folder / "sparse"))
    progress.Warn(
        "sparse/ stays behind: its poses are those of views, of which each becomes several pictures here");
}

void WriteFrames(const Input& input, const fs::path& folder, Progress& progress) {
  SessionInfo info = NewSessionInfo();
  info.camera = ToJson(CameraInfo{"import:" + input.folder.string(), "", "pictures", ""});
  info.camera.update(input.binding.camera);
  info.settings = input.binding.settings;
  info.sensor = ToJson(input.sensor);
  if (input.calibration) info.sensor["calibration"] = fs::absolute(input.calibration->folder).string();
  SessionWriter writer(folder, info, kSegmentBytes);
  const PixelFormat format = FormatFor(input.sensor);
  FrameCounts counts;
  progress.Begin("importing", input.views.size(), "picture");
  for (std::size_t i = 0; i < input.views.size(); ++i) {
    progress.Check();
    const LoadedView view = ReadView(input, int(i));
    WriteMaskOf(view, input.views[i], folder);
    for (std::size_t k = 0; k < view.pictures.size(); ++k) {
      const Frame frame = FrameOf(view, k, format, counts.stored, i);
      writer.Append(frame);
      ++counts.stored;
      counts.bytes += frame.payload.size();
    }
    progress.Advance();
  }
  CopyMasksAndPoses(input.folder, folder);
  writer.Close(counts);
}

void WriteCounts(const fs::path& path, const Image<std::uint16_t>& counts) {
  path.extension() == ".png" ? WritePng(path, counts) : WriteTiff(path, counts);
}

Image<std::uint16_t> AngleCounts(const Image<float>& light) {
  Image<std::uint16_t> counts(light.width(), light.height());
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const float dn = kAnglesBlack_dn + light.pixels()[i] * (kAnglesWhite_dn - kAnglesBlack_dn);
    counts.pixels()[i] = std::uint16_t(std::lround(std::clamp(dn, 0.0f, kAnglesWhite_dn)));
  }
  return counts;
}

// A new folder that is being filled; of what is not kept nothing stays.
class FolderToFill {
 public:
  explicit FolderToFill(const fs::path& folder) : folder_(folder) { RequireNewSessionFolder(folder); }
  FolderToFill(const FolderToFill&) = delete;
  ~FolderToFill() {
    std::error_code ignored;  // something else has failed, and is told
    if (kept_ || !fs::is_directory(folder_, ignored)) return;
    for (const auto& entry : fs::directory_iterator(folder_, ignored)) fs::remove_all(entry.path(), ignored);
  }
  void Keep() { kept_ = true; }

 private:
  fs::path folder_;
  bool kept_ = false;
};

}  // namespace

std::size_t ImportSession(const Input& input, const fs::path& folder, Progress& progress) {
  if (input.session)
    throw Error("this is a session already", input.folder.string(), "reconstruct and check take it as it is");
  if (input.kind != InputKind::kMosaic || input.sensor.bits > 16)
    throw Error("only raw mosaics of up to 16 bits become a session", input.folder.string(),
                "Everything else goes to reconstruct and demosaic as it is");
  FolderToFill filling(folder);
  WriteFrames(input, folder, progress);
  filling.Keep();
  return input.views.size();
}

std::size_t ExportSession(const Session& session, const fs::path& folder, const std::string& extension,
                          Progress& progress) {
  FolderToFill filling(folder);
  progress.Begin("exporting", session.frames.size(), "frame");
  const std::vector<SessionView> views = ViewsOf(session);
  const bool several =
      std::ranges::any_of(views, [&](const auto& view) { return !ExposuresOf(session, view).empty(); });
  std::map<std::string, std::vector<std::string>> names;
  for (const SessionView& view : views)
    for (std::size_t i = 0; i < view.frames.size(); ++i) {
      progress.Check();
      const FrameInfo& info = session.frames[view.frames[i]].info;
      const auto same = std::size_t(
          std::count_if(view.frames.begin(), view.frames.begin() + std::ptrdiff_t(i), [&](std::size_t frame) {
            return !several || session.frames[frame].info.exposure_us == info.exposure_us;
          }));
      const bool alone = several ? same == 0 : view.frames.size() == 1;
      const std::string name = alone ? view.name : fmt::format("{}-{}", view.name, same);
      const Image<std::uint16_t> counts = Counts(ReadFrame(session, view.frames[i]));
      names[view.name].push_back(name);
      const std::string subfolder = several ? fmt::format("exposure-{}", info.exposure_us) : "mosaic";
      WriteCounts(folder / subfolder / (name + "." + extension), counts);
      progress.Advance();
    }
  const bool one_name = std::ranges::all_of(names, [](const auto& view) {
    return std::ranges::all_of(view.second, [&](const auto& name) { return name == view.first; });
  });
  one_name ? CopyMasksAndPoses(session.folder, folder) : CopyMasks(session, names, folder, progress);
  WriteJson(folder / "set.json", {{"input_kind", "mosaic"},
                                  {"sensor", SensorOf(session)},
                                  {"camera", session.info.camera},
                                  {"settings", session.info.settings}});
  filling.Keep();
  return session.frames.size();
}

std::size_t ExportAngles(const Input& input, const DemosaicMethod& method, const fs::path& folder,
                         const std::string& extension, Progress& progress) {
  if (input.kind != InputKind::kMosaic || !input.sensor.layout.bayer.empty())
    throw Error("only raw mosaics of mono sensors are exported by angle", input.folder.string(),
                "polarscan demosaic makes Stokes views of every input");
  FolderToFill filling(folder);
  progress.Begin("exporting", input.views.size());
  for (std::size_t i = 0; i < input.views.size(); ++i) {
    progress.Check();
    const LoadedView view = ReadView(input, int(i));
    WriteMaskOf(view, input.views[i], folder);
    const Image<float> light = MosaicOf(input, view).light;
    const AnglePlanes planes = method.interpolate(light, input.sensor.layout)[0];
    for (std::size_t a = 0; a < planes.size(); ++a)
      WriteCounts(folder / fmt::format("I-{:02}", kAnglesDeg[a]) / (view.name + "." + extension),
                  AngleCounts(planes[a]));
    progress.Advance();
  }
  CopyMasksAndPoses(input.folder, folder);
  WriteJson(folder / "set.json",
            {{"input_kind", "angles"},
             {"sensor", {{"bits", 16}, {"black_dn", kAnglesBlack_dn}, {"white_dn", kAnglesWhite_dn}}}});
  filling.Keep();
  return input.views.size();
}

std::size_t ExportCorrected(const Input& input, const fs::path& folder, const std::string& extension,
                            Progress& progress) {
  if (!input.calibration)
    throw Error("there is no calibration to apply", input.folder.string(),
                "Give its folder with --calibration");
  FolderToFill filling(folder);
  progress.Begin("correcting", input.views.size());
  for (std::size_t i = 0; i < input.views.size(); ++i) {
    progress.Check();
    const LoadedView view = ReadView(input, int(i));
    WriteMaskOf(view, input.views[i], folder);
    LitMosaic mosaic = MosaicOf(input, view);
    for (std::size_t k = 0; k < mosaic.light.size(); ++k)
      if (mosaic.state.pixels()[k] == SampleState::kLost) mosaic.light.pixels()[k] = 1;
    WriteCounts(folder / "mosaic" / (view.name + "." + extension), AngleCounts(mosaic.light));
    progress.Advance();
  }
  CopyMasksAndPoses(input.folder, folder);
  Sensor sensor = input.sensor;
  sensor.bits = 16, sensor.black_dn = kAnglesBlack_dn, sensor.white_dn = kAnglesWhite_dn;
  sensor.dn_per_e *= sensor.RangeDn() / input.sensor.RangeDn();
  WriteJson(folder / "set.json",
            {{"input_kind", "mosaic"}, {"sensor", ToJson(sensor)}, {"camera", input.binding.camera}});
  filling.Keep();
  return input.views.size();
}

}  // namespace polarscan
