// SPDX-License-Identifier: Apache-2.0
// Every reader on 1000 damaged files, in the manner of OpenEXR's tests: a window of random bytes slid over a
// good file, cuts, lost and doubled pieces. What is not noticed must be harmless: `polarscan check` of the
// scan, by checksums, notices all of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <functional>

#include "core/error.h"
#include "core/files/files.h"
#include "core/random.h"
#include "demosaic/calibration/calibration.h"
#include "fusion/mesh_files.h"
#include "pipeline/check_files.h"
#include "pipeline/checksums.h"
#include "program.h"
#include "stereo/map_io.h"
#include "stereo/sfm/model/model.h"
#include "stereo/workspace.h"
#include "toy_scan.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

constexpr int kTrials = 1000;
constexpr std::size_t kHead = 2048, kWindowBytes = 16;

enum class Way { kWindowAtTheHead, kWindow, kCut, kPiece };

// Another file for each trial; never the good one.
std::string Damaged(const std::string& good, int trial) {
  Random random(11, std::uint64_t(trial));
  const auto below = [&](std::size_t limit) { return std::size_t(random.Below(std::uint32_t(limit))); };
  std::string bytes = good;
  const Way way = Way(trial % 4);
  // Slid from front to end in the course of the trials.
  const std::size_t range = way == Way::kWindowAtTheHead ? std::min(kHead, good.size()) : good.size();
  const std::size_t at = std::size_t(trial) * range / kTrials;
  if (way == Way::kCut) return bytes.substr(0, at);
  if (way == Way::kPiece) {
    const std::size_t size = 1 + below(std::min<std::size_t>(64, good.size() - at));
    return below(2) ? bytes.erase(at, size) : bytes.insert(at, good.substr(at, size));
  }
  for (std::size_t i = at; i < std::min(at + kWindowBytes, bytes.size()); ++i)
    if (below(3) == 0) bytes[i] = char(below(256));
  if (bytes == good) bytes[at] = char(bytes[at] ^ 1);
  return bytes;
}

// Without the syncing of core/files/files.h, which takes most of the time.
void Write(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

struct Tally {
  int refused = 0;
  std::vector<int> accepted;  // trials
  bool AcceptedA(Way way) const {
    return std::ranges::any_of(accepted, [&](int trial) { return Way(trial % 4) == way; });
  }
};

// An Error that names a file below the folder is a refusal; anything else that is thrown fails the test.
Tally DamageAll(const fs::path& victim, const std::function<void()>& check) {
  check();  // the good one
  const std::string good = ReadFile(victim);
  Tally tally;
  for (int trial = 0; trial < kTrials; ++trial) {
    Write(victim, Damaged(good, trial));
    try {
      check();
      tally.accepted.push_back(trial);
    } catch (const Error& error) {
      ++tally.refused;
      EXPECT_NE(std::string(error.what()).find(victim.parent_path().filename()), std::string::npos)
          << error.what();
    }
  }
  Write(victim, good);
  check();
  return tally;
}

class Damage : public testing::Test {
 protected:
  void SetUp() override { WriteToyScan(folder_.path(), 3, 48, 36); }
  fs::path Map(const std::string& kind) const {
    return folder_ / ("dense/stereo/" + kind + "_maps/ball00.png.geometric.bin");
  }
  TemporaryFolder folder_;
};

TEST_F(Damage, DepthMapsOfAWrongLengthAreRefusedAndWhatIsReadIsWhatTheFileHolds) {
  const Tally tally = DamageAll(Map("depth"), [&] {
    CheckMap(Map("depth"));
    const Image<float> depth = ReadDepthMap(Map("depth"));
    EXPECT_TRUE(ReadFile(Map("depth"))
                    .ends_with(std::string_view(reinterpret_cast<const char*>(depth.row(0)),
                                                depth.size() * sizeof(float))));
  });
  EXPECT_FALSE(tally.AcceptedA(Way::kCut) || tally.AcceptedA(Way::kPiece));
  EXPECT_GE(tally.refused, kTrials / 2);
}

TEST_F(Damage, NormalMapsNoticeMostOfItBecauseNormalsHaveLengthOne) {
  const Tally tally = DamageAll(Map("normal"), [&] { CheckMap(Map("normal")); });
  EXPECT_FALSE(tally.AcceptedA(Way::kCut) || tally.AcceptedA(Way::kPiece));
  EXPECT_GE(tally.refused, kTrials * 8 / 10);
}

TEST_F(Damage, CloudsOfAWrongLengthAreRefused) {
  const Tally tally = DamageAll(folder_ / "cloud.ply", [&] { CheckPly(folder_ / "cloud.ply"); });
  EXPECT_FALSE(tally.AcceptedA(Way::kCut));
  EXPECT_GE(tally.refused, kTrials / 4);
}

TEST_F(Damage, StlAndObjAreReadOrRefusedAndAnStlThatIsCutIsRefused) {
  SurfaceMesh mesh;
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3f p(i == 2, i == 1, i == 3);
    mesh.vertices.push_back({p, Eigen::Vector3f::UnitZ(), {1, 2, 3}});
  }
  for (const char* name : {"m.stl", "m.obj"}) {
    WriteMeshFile(folder_ / name, mesh);
    const Tally tally = DamageAll(folder_ / name, [&] {
      const TriangleMesh read = ReadMesh(folder_ / name);
      for (const auto& triangle : read.triangles)
        for (const std::uint32_t i : triangle) EXPECT_TRUE(read.vertices.at(i).allFinite());
    });
    EXPECT_FALSE(name[2] == 's' && tally.AcceptedA(Way::kCut));
    EXPECT_GE(tally.refused, kTrials / 10) << name;
  }
}

TEST_F(Damage, BinaryModelsOfAWrongLengthAreRefused) {
  SparseModel model;
  model.cameras[1] = {1, "PINHOLE", 48, 36, {50, 50, 24, 18}};
  for (std::uint32_t i = 1; i <= 4; ++i)
    model.images[i] = {i, 1, {}, "ball0" + std::to_string(i) + ".png", {{1.5, 2.5, 7}, {3, 4, -1}}};
  model.points[7] = {{1, 2, 3}, {4, 5, 6}, 0.5, {{1, 0}, {2, 0}, {3, 0}, {4, 0}}};
  for (const bool binary : {true, false}) {
    const fs::path folder = folder_ / (binary ? "binary" : "text");
    binary ? WriteSparseModelBinary(folder, model) : WriteSparseModelText(folder, model);
    for (const char* name : {"cameras", "images", "points3D"}) {
      const fs::path file = folder / (std::string(name) + (binary ? ".bin" : ".txt"));
      const Tally tally = DamageAll(file, [&] { CheckModel(folder); });
      EXPECT_FALSE(binary && tally.AcceptedA(Way::kCut)) << name;
      EXPECT_GE(tally.refused, kTrials / 10) << name << binary;
    }
  }
}

TEST_F(Damage, AWorkspacesListOfViewsIsReadOrRefused) {
  const Tally tally = DamageAll(folder_ / "dense/views.json", [&] { CheckWorkspace(folder_ / "dense"); });
  EXPECT_FALSE(tally.AcceptedA(Way::kCut) && tally.accepted.back() < kTrials - 8)
      << "cut before its last brace";
  EXPECT_GE(tally.refused, kTrials / 2);
}

TEST_F(Damage, StokesViewsThatWereCutAreRefused) {
  const fs::path view = folder_ / "dense/polar/ball00.tif";
  const Tally tally = DamageAll(view, [&] { CheckPicture(view); });
  EXPECT_FALSE(tally.AcceptedA(Way::kCut));
  EXPECT_GE(tally.refused, kTrials / 4);
}

TEST_F(Damage, ACalibrationIsRefusedWhateverWasDamaged) {
  Calibration calibration;
  calibration.sensor.layout = ParseLayout("90 45 / 135 0");
  calibration.sensor.bits = 12, calibration.sensor.white_dn = 4000, calibration.sensor.black_dn = 60.25;
  calibration.binding = MakeBinding({{"vendor", "V"}}, {{"Gain", 6.0}}, 6, 4, calibration.sensor.layout, 12);
  calibration.correction.black_dn = Image<float>(6, 4, 60.5f);
  const fs::path folder = folder_ / "calibration";
  WriteCalibration(folder, calibration);
  const nlohmann::json meant = ReadJson(folder / "calibration.json");
  const Tally tally = DamageAll(folder / "calibration.json", [&] {
    ReadCalibration(folder);
    EXPECT_EQ(ReadJson(folder / "calibration.json"), meant) << "accepted, though it says something else";
  });
  EXPECT_GE(tally.refused, kTrials * 8 / 10);
}

TEST_F(Damage, ChecksumsNoticeAllOfIt) {
  const Checksums checksums(folder_.path());
  const FileSums good = checksums.Measure({"cloud.ply", "dense"}, true);
  EXPECT_EQ(Difference(good, checksums.Measure({"dense", "cloud.ply"}, true)), "");
  int noticed = 0;
  DamageAll(folder_ / "cloud.ply", [&] {
    const FileSums found = checksums.Measure({"cloud.ply", "dense"}, true);
    noticed +=
        Digest(found) != Digest(good) && Difference(good, found) == "cloud.ply is damaged or was changed";
  });
  EXPECT_EQ(noticed, kTrials);
}

}  // namespace
}  // namespace polarscan::test
