// SPDX-License-Identifier: Apache-2.0
// COLMAP's cameras.txt, images.txt, points3D.txt: lines starting with # are comments; an image takes two
// lines, of which the second (its observations) may be empty.
#include <fmt/format.h>

#include <sstream>

#include "core/error.h"
#include "core/files.h"
#include "stereo/sfm/camera_models.h"
#include "stereo/sfm/model_files.h"

namespace polarscan {
namespace {

// The lines of a file, without comments; empty lines count.
class Lines {
 public:
  explicit Lines(const std::filesystem::path& path) : path_(path), text_(ReadFile(path)) {}

  bool Next(std::istringstream& line) {
    while (position_ < text_.size()) {
      const std::size_t end = std::min(text_.find('\n', position_), text_.size());
      const std::string content = text_.substr(position_, end - position_);
      position_ = end + 1;
      ++number_;
      if (content.starts_with("#")) continue;
      line = std::istringstream(content);
      return true;
    }
    return false;
  }
  [[noreturn]] void Fail() const {
    throw Error(fmt::format("damaged COLMAP model: line {} cannot be read", number_), path_.string(),
                "Copy it again from where it came, or make it anew");
  }

 private:
  std::filesystem::path path_;
  std::string text_;
  std::size_t position_ = 0;
  int number_ = 0;
};

bool IsEmpty(std::istringstream& line) { return (line >> std::ws).eof(); }

ColmapCamera ParseCamera(std::istringstream& line, const Lines& lines) {
  ColmapCamera camera;
  line >> camera.id >> camera.model >> camera.width >> camera.height;
  const bool good = bool(line);
  for (double value; line >> value;) camera.params.push_back(value);
  const CameraModel* model = FindCameraModel(camera.model);
  if (!good || !line.eof() || camera.width <= 0 || camera.height <= 0 ||
      (model && model->parameters != int(camera.params.size())))
    lines.Fail();
  return camera;
}

ColmapImage ParseImage(std::istringstream& line, const Lines& lines) {
  ColmapImage image;
  double pose[7];
  line >> image.id;
  for (double& value : pose) line >> value;
  line >> image.camera_id >> std::ws;
  if (!line || !SetPose(pose, image.cam_from_world) || !std::getline(line, image.name)) lines.Fail();
  while (!image.name.empty() && std::isspace(static_cast<unsigned char>(image.name.back())))
    image.name.pop_back();
  return image;
}

void ParseObservations(std::istringstream& line, const Lines& lines, ColmapImage& image) {
  while (!IsEmpty(line)) {
    ColmapImage::Observation observation;
    if (!(line >> observation.x >> observation.y >> observation.point_id)) lines.Fail();
    image.observations.push_back(observation);
  }
}

void ParsePoint(std::istringstream& line, const Lines& lines, SparseModel& model) {
  std::uint64_t id = 0;
  ColmapPoint point;
  line >> id >> point.position[0] >> point.position[1] >> point.position[2];
  for (std::uint8_t& channel : point.rgb) {
    int value = 0;
    line >> value;
    channel = std::uint8_t(value);
  }
  if (!(line >> point.error_px)) lines.Fail();
  while (!IsEmpty(line)) {
    ColmapPoint::Track track;
    if (!(line >> track.image_id >> track.observation)) lines.Fail();
    point.track.push_back(track);
  }
  model.points[id] = std::move(point);
}

std::string ImageLines(const ColmapImage& image) {
  std::string text = fmt::format("{} {} {} {}\n", image.id, fmt::join(GetPose(image.cam_from_world), " "),
                                 image.camera_id, image.name);
  const char* separator = "";
  for (const ColmapImage::Observation& observation : image.observations) {
    text += fmt::format("{}{} {} {}", separator, observation.x, observation.y, observation.point_id);
    separator = " ";
  }
  return text + "\n";
}

std::string PointLine(std::uint64_t id, const ColmapPoint& point) {
  std::string text =
      fmt::format("{} {} {} {} {} {} {} {}", id, point.position.x(), point.position.y(), point.position.z(),
                  point.rgb[0], point.rgb[1], point.rgb[2], point.error_px);
  for (const ColmapPoint::Track& track : point.track)
    text += fmt::format(" {} {}", track.image_id, track.observation);
  return text + "\n";
}

}  // namespace

SparseModel ReadTextModel(const std::filesystem::path& folder) {
  SparseModel model;
  std::istringstream line;
  for (Lines cameras(folder / "cameras.txt"); cameras.Next(line);) {
    if (IsEmpty(line)) continue;
    const ColmapCamera camera = ParseCamera(line, cameras);
    model.cameras[camera.id] = camera;
  }
  for (Lines images(folder / "images.txt"); images.Next(line);) {
    if (IsEmpty(line)) continue;
    ColmapImage image = ParseImage(line, images);
    if (images.Next(line)) ParseObservations(line, images, image);
    model.images[image.id] = std::move(image);
  }
  if (!std::filesystem::exists(folder / "points3D.txt")) return model;
  for (Lines points(folder / "points3D.txt"); points.Next(line);)
    if (!IsEmpty(line)) ParsePoint(line, points, model);
  return model;
}

void WriteSparseModelText(const std::filesystem::path& folder, const SparseModel& model) {
  std::string cameras = "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS...\n";
  std::string images = "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then a line of X Y POINT3D_ID\n";
  std::string points = "# POINT3D_ID X Y Z R G B ERROR, then IMAGE_ID POINT2D_IDX of the track\n";
  for (const auto& [id, c] : model.cameras)
    cameras += fmt::format("{} {} {} {} {}\n", id, c.model, c.width, c.height, fmt::join(c.params, " "));
  for (const auto& [id, image] : model.images) images += ImageLines(image);
  for (const auto& [id, point] : model.points) points += PointLine(id, point);
  WriteFileAtomically(folder / "cameras.txt", cameras);
  WriteFileAtomically(folder / "images.txt", images);
  WriteFileAtomically(folder / "points3D.txt", points);
  WriteOffset(folder, model.offset);
}

}  // namespace polarscan
