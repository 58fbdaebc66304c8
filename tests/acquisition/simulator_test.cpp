// SPDX-License-Identifier: Apache-2.0
#include "simulation/simulator.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>

#include "azimuth.h"
#include "core/error.h"
#include "core/files/files.h"
#include "core/formats/image_io.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

// ---- sensor

TEST(SimulatorSensor, NoiseFollowsThePhotonTransferModel) {
  const SimulatedSensor sensor;
  for (double signal : {0.0005, 0.002, 0.05, 0.4, 0.9}) {
    Random random(5, std::uint64_t(signal * 1e6));
    const int n = 40000;
    double sum = 0, square = 0;
    for (int i = 0; i < n; ++i) {
      const double count = sensor.Count(signal, random);
      sum += count;
      square += count * count;
    }
    const double mean = sum / n, variance = square / n - mean * mean;
    const double electrons = signal * sensor.full_well_e, k = sensor.dn_per_e();
    const double expected = k * k * (electrons + 2.5 * 2.5) + 1.0 / 12;
    EXPECT_NEAR(mean, 60 + k * electrons, 5 * std::sqrt(expected / n)) << signal;
    EXPECT_NEAR(variance / expected, 1, 5 * std::sqrt(2.0 / n) + 0.01) << signal;
  }
}

TEST(SimulatorSensor, ClipsAtTheFullWellAndKeepsWithinItsBits) {
  Random random(1);
  SimulatedSensor sensor;
  for (int bits : {8, 10, 12, 14, 16}) {
    sensor.bits = bits;
    sensor.noise = true;
    EXPECT_LE(sensor.Count(50, random), sensor.max_dn());
    sensor.noise = false;
    EXPECT_EQ(sensor.Count(50, random), std::lround(sensor.max_dn() * 4000.0 / 4095));
    EXPECT_EQ(sensor.Count(0, random), sensor.black_dn());
  }
}

// ---- whole sets

class SimulatorFolder : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("polarscan-simulator-" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  static SimulatorOptions Small() {
    SimulatorOptions options;
    options.scene.scene = "sphere";
    options.rings = "33:2,60:1";
    options.width = 122;
    options.height = 102;
    options.masks = true;
    return options;
  }
  fs::path folder_;
  Progress silent_;
};

std::map<std::string, std::string> AllFiles(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files[fs::relative(entry.path(), folder).string()] = ReadFile(entry.path());
  return files;
}

TEST_F(SimulatorFolder, TheSameSeedGivesTheSameBytesForOneAndTwoThreads) {
  for (int threads : {1, 2}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
    Simulate(Small(), folder_ / std::to_string(threads), silent_);
  }
  const auto one = AllFiles(folder_ / "1"), two = AllFiles(folder_ / "2");
  EXPECT_EQ(one.size(), 12u);  // 3 mosaics, 3 masks, set.json, 2 meshes, 3 of the model
  for (const auto& [name, bytes] : one) EXPECT_TRUE(two.contains(name) && two.at(name) == bytes) << name;
  SimulatorOptions other = Small();
  other.seed = 1;
  Simulate(other, folder_ / "other", silent_);
  EXPECT_NE(AllFiles(folder_ / "other").at("mosaic/000000.png"), one.at("mosaic/000000.png"));
}

// Reads the model's own text, as a stranger would.
std::pair<Pinhole, std::map<std::string, Rigid>> ReadPoses(const fs::path& folder) {
  Pinhole camera;
  std::string word;
  std::istringstream cameras(ReadFile(folder / "cameras.txt"));
  std::getline(cameras, word);
  cameras >> word >> word >> camera.width >> camera.height >> camera.fx >> camera.fy >> camera.cx >>
      camera.cy;
  std::map<std::string, Rigid> poses;
  std::istringstream images(ReadFile(folder / "images.txt"));
  for (std::string line; std::getline(images, line);) {
    std::istringstream row(line);
    double w, x, y, z;
    Rigid pose;
    Vector3d& t = pose.translation;
    if (line.empty() || !(row >> word >> w >> x >> y >> z >> t.x() >> t.y() >> t.z() >> word >> word))
      continue;
    pose.rotation = Eigen::Quaterniond(w, x, y, z).toRotationMatrix();
    poses[word] = pose;
  }
  return {camera, poses};
}

// The check of a set against its own truth and nothing of the renderer: rays from the sparse model into the
// mesh.
TEST_F(SimulatorFolder, PicturesMasksPosesAndMeshAgree) {
  SimulatorOptions options = Small();
  options.width = 408;
  options.height = 340;
  options.known_poses = true;
  options.sensor.full_well_e = 1e5;  // little noise
  Simulate(options, folder_, silent_);
  EXPECT_EQ(ReadFile(folder_ / "sparse/images.txt"), ReadFile(folder_ / "truth/sparse/images.txt"));
  const RayCaster caster({ReadMesh(folder_ / "truth/mesh.ply"), ReadMesh(folder_ / "truth/table.ply")});
  const auto [camera, poses] = ReadPoses(folder_ / "truth/sparse");
  ASSERT_EQ(poses.size(), 3u);
  std::vector<double> errors, mirrored;
  int outside = 0;
  for (const auto& [name, pose] : poses) {
    const Image<float> raw = ReadPicture(folder_ / "mosaic" / name).planes.at(0);
    const Image<std::uint8_t> mask = ReadMask(folder_ / "masks" / name);
    for (int y = 1; y < raw.height(); y += 2)
      for (int x = 1; x < raw.width(); x += 2) {
        const Vector3d ray = camera.Ray(x, y);  // the middle of the 2x2 cell
        const RayCaster::Hit hit = caster.Cast(pose.Center(), pose.rotation.transpose() * ray);
        outside += (hit.mesh == 0) != (mask(x, y) > 0);
        if (hit.mesh != 0) continue;
        const double i90 = raw(x - 1, y - 1), i45 = raw(x, y - 1), i135 = raw(x - 1, y), i0 = raw(x, y);
        const double s0 = (i0 + i45 + i90 + i135 - 240) / 2, s1 = i0 - i90, s2 = i45 - i135;
        if (std::hypot(s1, s2) < 0.12 * s0) continue;
        const Vector3d n = pose.rotation * caster.Normal(hit);
        const double azimuth = Azimuth(n, ray.x(), ray.y());
        errors.push_back(std::abs(std::remainder(std::atan2(s2, s1) / 2 - azimuth, kPi / 2)));
        mirrored.push_back(std::abs(std::remainder(std::atan2(-s2, s1) / 2 - azimuth, kPi / 2)));
      }
  }
  EXPECT_LT(outside, 700);  // pixels on the outline
  ASSERT_GT(errors.size(), 1000u);
  const auto median = [](std::vector<double>& v) {
    std::nth_element(v.begin(), v.begin() + std::ptrdiff_t(v.size() / 2), v.end());
    return v[v.size() / 2] * 180 / kPi;
  };
  EXPECT_LT(median(errors), 5);
  EXPECT_GT(median(mirrored), 10);
}

TEST_F(SimulatorFolder, ASecondRunReplacesTheSameSimulationButNothingElse) {
  Simulate(Small(), folder_ / "set", silent_);
  fs::remove(folder_ / "set/mosaic/000000.png");
  Simulate(Small(), folder_ / "set", silent_);
  EXPECT_TRUE(fs::exists(folder_ / "set/mosaic/000000.png"));
  SimulatorOptions fewer = Small(), other = Small();
  fewer.rings = "33:1";
  other.seed += 1;
  const std::string before = ReadFile(folder_ / "set/mosaic/000000.png");
  for (const SimulatorOptions& options : {fewer, other}) {
    EXPECT_THROW(Simulate(options, folder_ / "set", silent_), Error);
    EXPECT_EQ(ReadFile(folder_ / "set/mosaic/000000.png"), before);
  }
  fs::create_directories(folder_ / "photos");
  std::ofstream(folder_ / "photos/holiday.jpg") << "precious";
  EXPECT_THROW(Simulate(fewer, folder_ / "photos", silent_), Error);
  EXPECT_EQ(ReadFile(folder_ / "photos/holiday.jpg"), "precious");
}

TEST_F(SimulatorFolder, CancellingStopsAndTheNextRunStartsAfresh) {
  struct : Progress {  // when the folder is there
    void Begin(const std::string& step, std::size_t, const std::string&) override {
      if (step.starts_with("taking")) Cancel();
    }
  } cancelled;
  EXPECT_THROW(Simulate(Small(), folder_, cancelled), Cancelled);
  EXPECT_EQ(ReadJson(folder_ / "set.json").at("complete"), false);
  Simulate(Small(), folder_, silent_);
  EXPECT_EQ(ReadJson(folder_ / "set.json").at("complete"), true);
}

TEST_F(SimulatorFolder, BadOptionsAreNamed) {
  const auto refuses = [&](auto change) {
    SimulatorOptions options = Small();
    change(options);
    EXPECT_THROW(Simulate(options, folder_ / "set", silent_), Error);
  };
  refuses([](SimulatorOptions& o) { o.scene.scene = "teapot"; });
  refuses([](SimulatorOptions& o) { o.scene.light = "disco"; });
  refuses([](SimulatorOptions& o) { o.scene.mesh = "/nowhere.ply"; });
  refuses([](SimulatorOptions& o) { o.layout = "1 2 3 4"; });
  refuses([](SimulatorOptions& o) { o.width = 1; });
  for (const char* rings : {"", "33", "33:0", "33:x", "90:3", "33:3:3", "33:12;56:6"})
    refuses([rings](SimulatorOptions& o) { o.rings = rings; });
}

}  // namespace
}  // namespace polarscan
