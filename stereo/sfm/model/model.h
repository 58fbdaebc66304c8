// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/camera.h"

namespace polarscan {

// COLMAP's sparse model (https://colmap.github.io/format.html), versions 3.8 to 4.x. Ids are COLMAP's, not
// contiguous. Image coordinates and principal points: pixel centres at integer + 0.5.
struct ColmapCamera {
  std::uint32_t id = 0;
  std::string model;  // "PINHOLE", "SIMPLE_RADIAL", "OPENCV", ...
  int width = 0, height = 0;
  std::vector<double> params;
};

struct ColmapImage {
  std::uint32_t id = 0, camera_id = 0;
  Rigid cam_from_world;
  std::string name;
  struct Observation {
    double x = 0, y = 0;
    std::int64_t point_id = -1;  // -1: not triangulated
  };
  std::vector<Observation> observations;
};

struct ColmapPoint {
  Eigen::Vector3d position;
  std::array<std::uint8_t, 3> rgb{};
  double error_px = 0;
  struct Track {
    std::uint32_t image_id = 0, observation = 0;
  };
  std::vector<Track> track;
};

struct SparseModel {
  std::map<std::uint32_t, ColmapCamera> cameras;
  std::map<std::uint32_t, ColmapImage> images;
  std::map<std::uint64_t, ColmapPoint> points;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  // added to coordinates: those of the given poses
};

// The folder itself if it holds a model, else its only sub-folder that does (COLMAP's sparse/0). Throws Error
// if there is none or more than one.
std::filesystem::path FindSparseModel(const std::filesystem::path& folder);

// Reads cameras/images/points3D of FindSparseModel, binary if cameras.bin is there, else text; points3D may
// be missing (no points), and offset.txt (0). Counts are checked against the file sizes. Text may be written
// by hand (model_text.cpp). notes: what is odd but was read all the same. Throws Error on what cannot be
// read, naming file and line.
SparseModel ReadSparseModel(const std::filesystem::path& folder, std::vector<std::string>* notes = nullptr);
void WriteSparseModelText(const std::filesystem::path& folder, const SparseModel& model);
void WriteSparseModelBinary(const std::filesystem::path& folder, const SparseModel& model);

// offset.txt: one line "X Y Z". Writing 0 writes nothing, and removes nothing. Throws Error if it is damaged.
Eigen::Vector3d ReadOffset(const std::filesystem::path& folder);
void WriteOffset(const std::filesystem::path& folder, const Eigen::Vector3d& offset);

// Counts coordinates from `origin`, and adds that to the offset.
void MoveOrigin(SparseModel& model, const Eigen::Vector3d& origin);

// The camera as a pinhole (SIMPLE_PINHOLE, PINHOLE). Throws Error for a model with distortion.
Pinhole ToPinhole(const ColmapCamera& camera);

}  // namespace polarscan
