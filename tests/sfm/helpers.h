// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/files/files.h"
#include "core/files/process.h"
#include "core/formats/image_io.h"
#include "demosaic/stokes.h"
#include "stereo/sfm/model/model.h"
#include "stereo/workspace.h"

namespace polarscan {

// A test with a fresh folder that is removed at the end.
class FolderTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "polarscan-sfm-XXXXXX").string();
    folder = mkdtemp(name.data());
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  std::filesystem::path folder;
};

// Collects what a stage tells its caller.
class Listener : public Progress {
 public:
  void Warn(const std::string& message) override { warnings.push_back(message); }
  void Info(const std::string& message) override { infos.push_back(message); }
  bool Heard(const std::string& text) const { return IsIn(warnings, text); }
  bool HeardInfo(const std::string& text) const { return IsIn(infos, text); }
  std::vector<std::string> warnings, infos;

 private:
  static bool IsIn(const std::vector<std::string>& messages, const std::string& text) {
    return std::ranges::any_of(messages, [&](const auto& m) { return m.find(text) != std::string::npos; });
  }
};

// The message of the Error that `call` throws; "" (and a failure) if it throws none.
template <class F>
std::string ErrorOf(F&& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  ADD_FAILURE() << "no error was thrown";
  return "";
}

inline bool HasColmap() { return !FindProgram("colmap").empty(); }

// A camera at `position` looking at `target`, image y down along -up.
inline Rigid LookAt(const Eigen::Vector3d& position, const Eigen::Vector3d& target,
                    const Eigen::Vector3d& up = {0, 1, 0}) {
  const Eigen::Vector3d z = (target - position).normalized(), x = z.cross(up).normalized();
  Rigid pose;
  pose.rotation.row(0) = x;
  pose.rotation.row(1) = z.cross(x);
  pose.rotation.row(2) = z;
  pose.translation = -(pose.rotation * position);
  return pose;
}

// `count` views on a ring around the origin, all looking at it; names 000, 001, ...
inline std::vector<DenseView> Ring(int count, double radius = 4, double elevation_deg = 30) {
  std::vector<DenseView> views;
  for (int i = 0; i < count; ++i) {
    const double a = 2 * M_PI * i / count, e = elevation_deg * M_PI / 180;
    const Eigen::Vector3d position(radius * std::cos(a) * std::cos(e), radius * std::sin(e),
                                   radius * std::sin(a) * std::cos(e));
    char name[16];
    std::snprintf(name, sizeof name, "%03d", i);
    views.push_back({name, {120, 100, 150, 150, 60, 50}, LookAt(position, {0, 0, 0}), 0, 0, {}});
  }
  return views;
}

// A sparse model without points: one PINHOLE camera, an image per view (ids from 11), named NAME + extension.
inline SparseModel ModelOf(const std::vector<DenseView>& views, const std::string& extension = ".png") {
  SparseModel model;
  const Pinhole& c = views[0].camera;
  model.cameras[3] = {3, "PINHOLE", c.width, c.height, {c.fx, c.fy, c.cx, c.cy}};
  std::uint32_t id = 11;
  for (const DenseView& view : views) {
    model.images[id] = {id, 3, view.cam_from_world, view.name + extension, {}};
    ++id;
  }
  return model;
}

// Views as demosaicing writes them, with smooth made-up content that differs from view to view.
inline void WriteViews(const std::filesystem::path& folder, const std::vector<DenseView>& views) {
  int shift = 0;
  for (const DenseView& view : views) {
    const int w = view.camera.width, h = view.camera.height;
    StokesImage stokes{Image<float>(w, h), Image<float>(w, h), Image<float>(w, h), Image<float>(w, h, 0.01f)};
    Image<std::uint8_t> grey(w, h);
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        stokes.s0(x, y) = 0.5f + 0.001f * float(x + shift);
        stokes.s1(x, y) = 0.05f + 0.0003f * float(y);
        stokes.s2(x, y) = -0.02f + 0.0002f * float(x);
        grey(x, y) = std::uint8_t(100 + x / 2 + shift);
      }
    WriteStokes(folder / (view.name + ".tif"), stokes);
    WritePng(folder / (view.name + ".png"), grey);
    ++shift;
  }
}

}  // namespace polarscan
