// SPDX-License-Identifier: Apache-2.0
// COLMAP's cameras.bin, images.bin, points3D.bin (unchanged from 3.8 to 4.1; rigs.bin and frames.bin,
// since 3.12, say nothing that we need: images.bin holds the composed poses).
#include <Eigen/Geometry>
#include <bit>

#include "stereo/sfm/model/byte_reader.h"
#include "stereo/sfm/model/camera_models.h"
#include "stereo/sfm/model/model_files.h"

namespace polarscan {
namespace {

static_assert(std::endian::native == std::endian::little, "COLMAP's binary files are little endian");

ColmapCamera ReadCamera(ByteReader& file) {
  ColmapCamera camera;
  camera.id = file.Read<std::uint32_t>();
  const auto number = file.Read<std::int32_t>();
  const CameraModel* model = FindCameraModel(number);
  if (!model) file.Fail("unknown camera model number " + std::to_string(number));
  camera.model = model->name;
  const auto width = file.Read<std::uint64_t>(), height = file.Read<std::uint64_t>();
  if (width > kLargestPicture || height > kLargestPicture) file.Fail("impossible picture size");
  camera.width = int(width);
  camera.height = int(height);
  for (int i = 0; i < model->parameters; ++i) camera.params.push_back(file.Read<double>());
  return camera;
}

ColmapImage ReadImage(ByteReader& file, std::vector<std::string>& stretched) {
  ColmapImage image;
  image.id = file.Read<std::uint32_t>();
  double pose[7];
  for (double& value : pose) value = file.Read<double>();
  if (!SetPose(pose, image.cam_from_world)) file.Fail("impossible pose");
  image.camera_id = file.Read<std::uint32_t>();
  image.name = file.ReadText();
  if (IsStretched(pose)) stretched.push_back(image.name);
  image.observations.resize(file.ReadCount(24));
  for (ColmapImage::Observation& observation : image.observations) {
    observation.x = file.Read<double>();
    observation.y = file.Read<double>();
    observation.point_id = file.Read<std::int64_t>();
  }
  return image;
}

ColmapPoint ReadPoint(ByteReader& file) {
  ColmapPoint point;
  for (int i = 0; i < 3; ++i) point.position[i] = file.Read<double>();
  for (std::uint8_t& channel : point.rgb) channel = file.Read<std::uint8_t>();
  point.error_px = file.Read<double>();
  point.track.resize(file.ReadCount(8));
  for (ColmapPoint::Track& track : point.track) {
    track.image_id = file.Read<std::uint32_t>();
    track.observation = file.Read<std::uint32_t>();
  }
  return point;
}

std::string ImageBytes(const ColmapImage& image) {
  std::string bytes;
  AppendValue(bytes, image.id);
  for (const double value : GetPose(image.cam_from_world)) AppendValue(bytes, value);
  AppendValue(bytes, image.camera_id);
  bytes += image.name + '\0';
  AppendValue(bytes, std::uint64_t(image.observations.size()));
  for (const ColmapImage::Observation& observation : image.observations) {
    AppendValue(bytes, observation.x);
    AppendValue(bytes, observation.y);
    AppendValue(bytes, observation.point_id);
  }
  return bytes;
}

std::string CameraBytes(const ColmapCamera& camera) {
  const CameraModel* model = FindCameraModel(camera.model);
  if (!model || int(camera.params.size()) != model->parameters)
    throw Error("cannot write this camera",
                camera.model + ", " + std::to_string(camera.params.size()) + " parameters");
  std::string bytes;
  AppendValue(bytes, camera.id);
  AppendValue(bytes, std::int32_t(model->id));
  AppendValue(bytes, std::uint64_t(camera.width));
  AppendValue(bytes, std::uint64_t(camera.height));
  for (const double value : camera.params) AppendValue(bytes, value);
  return bytes;
}

std::string PointBytes(std::uint64_t id, const ColmapPoint& point) {
  std::string bytes;
  AppendValue(bytes, id);
  for (int i = 0; i < 3; ++i) AppendValue(bytes, point.position[i]);
  for (const std::uint8_t channel : point.rgb) AppendValue(bytes, channel);
  AppendValue(bytes, point.error_px);
  AppendValue(bytes, std::uint64_t(point.track.size()));
  for (const ColmapPoint::Track& track : point.track) {
    AppendValue(bytes, track.image_id);
    AppendValue(bytes, track.observation);
  }
  return bytes;
}

}  // namespace

SparseModel ReadBinaryModel(const std::filesystem::path& folder, std::vector<std::string>& notes) {
  SparseModel model;
  std::vector<std::string> stretched;
  ByteReader cameras(folder / "cameras.bin");
  for (std::size_t left = cameras.ReadCount(24); left > 0; --left) {
    const ColmapCamera camera = ReadCamera(cameras);
    model.cameras[camera.id] = camera;
  }
  cameras.ExpectEnd();
  ByteReader images(folder / "images.bin");
  for (std::size_t left = images.ReadCount(73); left > 0; --left) {
    ColmapImage image = ReadImage(images, stretched);
    model.images[image.id] = std::move(image);
  }
  images.ExpectEnd();
  AddNoteOnLengths(stretched, folder / "images.bin", notes);
  if (!std::filesystem::exists(folder / "points3D.bin")) return model;
  ByteReader points(folder / "points3D.bin");
  for (std::size_t left = points.ReadCount(51); left > 0; --left) {
    const auto id = points.Read<std::uint64_t>();
    model.points[id] = ReadPoint(points);
  }
  points.ExpectEnd();
  return model;
}

void WriteSparseModelBinary(const std::filesystem::path& folder, const SparseModel& model) {
  std::string cameras, images, points;
  AppendValue(cameras, std::uint64_t(model.cameras.size()));
  AppendValue(images, std::uint64_t(model.images.size()));
  AppendValue(points, std::uint64_t(model.points.size()));
  for (const auto& [id, camera] : model.cameras) cameras += CameraBytes(camera);
  for (const auto& [id, image] : model.images) images += ImageBytes(image);
  for (const auto& [id, point] : model.points) points += PointBytes(id, point);
  WriteFileAtomically(folder / "cameras.bin", cameras);
  WriteFileAtomically(folder / "images.bin", images);
  WriteFileAtomically(folder / "points3D.bin", points);
  WriteOffset(folder, model.offset);
}

}  // namespace polarscan
