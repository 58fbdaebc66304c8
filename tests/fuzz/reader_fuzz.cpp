// SPDX-License-Identifier: Apache-2.0
// A folder of good files, of which one is made by the fuzzer: what reads them returns, or throws an Error.
// Built once for each of the readers below (READER). `NAME_fuzz --seeds FOLDER` writes the good files, the
// corpus to begin with.
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <functional>
#include <iostream>

#include "../apps/toy_scan.h"
#include "acquisition/input/input.h"
#include "core/error.h"
#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "core/mesh.h"
#include "core/random.h"
#include "fusion/mesh_files.h"
#include "pipeline/check_files.h"
#include "pipeline/scan.h"
#include "simulation/gige/gige_server.h"
#include "simulation/gige/protocol.h"
#include "stereo/sfm/model/model.h"

using namespace polarscan;
namespace fs = std::filesystem;

namespace {

struct Reader {
  std::vector<std::string> files;  // that the fuzzer makes, relative to the folder
  std::function<void(const fs::path&)> make;
  std::function<void(const fs::path& folder, const std::string& file)> read;
};

constexpr int kWidth = 12, kHeight = 10;

// COLMAP's sparse models, binary and as text.
Reader ModelReader() {
  std::vector<std::string> files;
  for (const char* name : {"cameras", "images", "points3D"})
    for (const auto& [folder, ending] : {std::pair{"binary/", ".bin"}, {"text/", ".txt"}})
      files.push_back(std::string(folder) + name + ending);
  const auto make = [](const fs::path& folder) {
    SparseModel model;
    model.cameras[1] = {1, "PINHOLE", 48, 36, {50, 50, 24, 18}};
    model.cameras[2] = {2, "OPENCV", 48, 36, {50, 50, 24, 18, 0.1, 0, 0, 0}};
    for (std::uint32_t i = 1; i <= 4; ++i)
      model.images[i] = {i, 1 + i % 2, {}, "v" + std::to_string(i) + ".png", {{1.5, 2.5, 7}, {3, 4, -1}}};
    model.points[7] = {{1, 2, 3}, {4, 5, 6}, 0.5, {{1, 0}, {2, 0}, {3, 0}, {4, 0}}};
    WriteSparseModelBinary(folder / "binary", model);
    WriteSparseModelText(folder / "text", model);
  };
  return {files, make,
          [](const fs::path& folder, const std::string& file) { CheckModel((folder / file).parent_path()); }};
}

// COLMAP's maps, and the list of views of a dense workspace.
Reader WorkspaceReader() {
  return {{"dense/stereo/depth_maps/ball00.png.geometric.bin",
           "dense/stereo/normal_maps/ball00.png.geometric.bin", "dense/views.json"},
          [](const fs::path& folder) { test::WriteToyScan(folder, 2, kWidth, kHeight); },
          [](const fs::path& folder, const std::string& file) {
            file.ends_with(".bin") ? CheckMap(folder / file) : CheckWorkspace(folder / "dense");
          }};
}

Reader PlyReader() {
  const auto make = [](const fs::path& folder) {
    test::WriteToyScan(folder, 1, kWidth, kHeight);
    WriteFileAtomically(folder / "text.ply",
                        "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 3\nproperty float x\n"
                        "property double y\nproperty float z\nproperty uchar red\nelement face 1\n"
                        "property list uchar int vertex_indices\nend_header\n"
                        "0 0 0 1\n1 0 0 2\n0 1 0 3\n3 0 1 2\n");
    WriteMesh(folder / "mesh.ply",
              {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}}, {{0, 1, 2}}});
  };
  return {{"cloud.ply", "text.ply", "mesh.ply"}, make, [](const fs::path& folder, const std::string& file) {
            for (const auto& read : std::vector<std::function<void(const fs::path&)>>{
                     CheckPly, [](const fs::path& path) { ReadMesh(path); },
                     [](const fs::path& path) { ReadSurfaceMesh(path); }}) {
              try {
                read(folder / file);
              } catch (const Error&) {
              }
            }
          }};
}

Reader CalibrationReader() {
  const auto make = [](const fs::path& folder) {
    Calibration calibration;
    calibration.sensor.layout = ParseLayout("90 45 / 135 0");
    calibration.sensor.bits = 12, calibration.sensor.white_dn = 4000, calibration.sensor.black_dn = 60.25;
    calibration.binding =
        MakeBinding({{"vendor", "V"}}, {{"Gain", 6.0}}, 6, 4, calibration.sensor.layout, 12);
    calibration.correction.black_dn = Image<float>(6, 4, 60.5f);
    WriteCalibration(folder, calibration);
  };
  return {{"calibration.json"}, make, [](const fs::path& folder, const std::string&) {
            ReadCalibration(folder);
          }};
}

// Pictures, Stokes views among them. Their decoders are OpenCV's and libtiff's, as Debian built them.
Reader PictureReader() {
  return {{"dense/polar/ball00.tif", "a.png", "a.jpg", "a.tiff"},
          [](const fs::path& folder) {
            test::WriteToyScan(folder, 1, kWidth, kHeight);
            WritePng(folder / "a.png", Image<std::uint16_t>(kWidth, kHeight, 300));
            WriteTiff(folder / "a.tiff", Image<std::uint16_t>(kWidth, kHeight, 300));
            WriteFileAtomically(folder / "a.jpg", EncodeJpeg(Image<Rgb8>(kWidth, kHeight), 90));
          },
          [](const fs::path& folder, const std::string& file) { CheckPicture(folder / file); }};
}

// An input's set.json, and a list of exposures below it.
Reader InputReader() {
  const auto make = [](const fs::path& folder) {
    for (const char* name : {"a", "b"})
      WritePng(folder / (std::string(name) + ".png"), Image<std::uint16_t>(kWidth, kHeight, 300));
    WriteFileAtomically(
        folder / "set.json",
        R"({"kind": "mosaic", "sensor": {"layout": "90 45 / 135 0", "bits": 12, "black_dn": 60, "max_dn": 4095,
"full_well_e": 10000, "dn_per_e": 0.4, "read_noise_e": 2.5, "gamma": 1}, "camera": {"vendor": "V", "model": "",
"serial": "17"}, "settings": {"Gain": 0}, "shots": {"1": ["a", "b"]}, "exposures": {"a": 1, "b": 2.5}})");
  };
  return {{"set.json"}, make, [](const fs::path& folder, const std::string&) {
            const Input input = OpenInput(folder, {});
            Meaning(input), ToJson(input);
            for (int view = 0; view < int(input.views.size()); ++view) {
              const LoadedView loaded = ReadView(input, view);
              if (input.kind == InputKind::kMosaic) MosaicOf(input, loaded);
            }
          }};
}

// scan.json and checksums.json.
Reader ScanReader() {
  static Progress terminal;
  static const Stage stage{"views", {{"method", "fused"}}, "17"};
  const auto make = [](const fs::path& folder) {
    Scan scan = Scan::OpenOrCreate(folder, "/input", 1, terminal);
    scan.Run(stage, [&](Progress&) {
      WriteFileAtomically(folder / "views/a.tif", "a");
      return nlohmann::json{{"views", 1}};
    });
  };
  return {{"scan.json", "checksums.json"}, make, [](const fs::path& folder, const std::string&) {
            for (const bool open : {true, false}) {
              try {
                if (open) {
                  Scan scan = Scan::Open(folder, terminal);
                  scan.Check();
                  scan.Counts("views");
                  scan.ContinueAfter("views");
                } else {
                  Scan::Plan(folder, "/input", 1, terminal).Run(stage, {});
                }
              } catch (const Error&) {
              }
            }
            terminal.TakeWarnings();
          }};
}

// A camera that sends nothing.
class StillCamera : public Camera {
 public:
  CameraInfo info() const override { return {"simulated", "polarscan", "fuzzed", "0"}; }
  nlohmann::json sensor() const override { return {}; }
  nlohmann::json features() const override { return {}; }
  void Set(const std::string&, const std::string&) override {}
  void Start(Progress&) override {}
  void Stop() override {}
  Delivery Next(Frame&, std::chrono::milliseconds) override { return Delivery::kNothing; }
};

// Datagrams to our GigE Vision camera, each with its length (16 bits) before it; the camera is taken control
// of.
Reader GigeReader() {
  const auto put = [](Bytes& all, std::uint16_t command, const std::vector<std::uint32_t>& words) {
    static std::uint16_t id = 0;
    PutBig<std::uint16_t>(all, 8 + 4 * words.size());
    PutBig<std::uint16_t>(all, 0x4201);
    PutBig<std::uint16_t>(all, command);
    PutBig<std::uint16_t>(all, 4 * words.size());
    PutBig<std::uint16_t>(all, ++id);
    for (const std::uint32_t word : words) PutBig<std::uint32_t>(all, word);
  };
  const auto make = [put](const fs::path& folder) {
    Bytes all;
    put(all, gvcp::kDiscovery, {});
    put(all, gvcp::kReadMemory, {0x10000, 512});
    put(all, gvcp::kReadRegister, {0x0D04, 0x0A00});
    for (std::uint32_t at = 0xA000; at < 0xA0C0; at += 8) {
      put(all, gvcp::kWriteRegister, {at, 1});
      put(all, gvcp::kWriteMemory, {at, 0x40240000, 0});  // 10.0
    }
    put(all, gvcp::kWriteRegister, {0x0D04, 0x80000000 | 1500});
    put(all, gvcp::kResend, {0x00000001, 0, 7});
    WriteFileAtomically(folder / "datagrams", std::string(all.begin(), all.end()));
  };
  return {{"datagrams"}, make, [](const fs::path& folder, const std::string& file) {
            static StillCamera camera;
            GigeServer server(
                {camera, 64, 48, {"Mono8", "Mono12p"}, 10, {}},
                "127.9." + std::to_string(getpid() / 250 % 250) + "." + std::to_string(1 + getpid() % 250),
                {});
            const std::string text = ReadFile(folder / file);
            const ByteView all{reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
            server.Answer(Bytes{0x42, 1, 0, 0x82, 0, 8, 0xff, 0xff, 0, 0, 0x0A, 0, 0, 0, 0, 2});
            for (std::size_t at = 0; at + 2 <= all.size();) {
              const std::size_t size = GetBig<std::uint16_t>(all, at);
              server.Answer(all.subspan(at + 2, std::min(size, all.size() - at - 2)));
              at += 2 + size;
            }
          }};
}

const Reader& TheReader() {
  static const Reader reader = READER();
  return reader;
}

const fs::path& Folder() {
  static const fs::path folder = [] {
    const fs::path memory = "/dev/shm";
    const fs::path path = (fs::exists(memory) ? memory : fs::temp_directory_path()) /
                          ("polarscan-fuzz-" + std::to_string(getpid()));
    fs::create_directories(path);
    TheReader().make(path);
    std::atexit([] { fs::remove_all(Folder()); });
    return path;
  }();
  return folder;
}

void Write(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

// What the fuzzer makes: the number of the file, then its bytes.
void WriteSeeds(const fs::path& corpus) {
  fs::create_directories(corpus);
  for (std::size_t i = 0; i < TheReader().files.size(); ++i)
    Write(corpus / ("good" + std::to_string(i)), char(i) + ReadFile(Folder() / TheReader().files[i]));
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
  if (*count == 3 && (*arguments)[1] == std::string("--seeds")) {
    WriteSeeds((*arguments)[2]);
    std::exit(0);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string& file = TheReader().files[data[0] % TheReader().files.size()];
  static std::map<std::string, std::string> good;
  if (!good.contains(file)) good[file] = ReadFile(Folder() / file);
  Write(Folder() / file, std::string(data + 1, data + size));
  try {
    TheReader().read(Folder(), file);
  } catch (const Error&) {
  }
  Write(Folder() / file, good[file]);
  return 0;
}
