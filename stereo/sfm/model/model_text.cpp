// SPDX-License-Identifier: Apache-2.0
// COLMAP's cameras.txt, images.txt, points3D.txt, also as people write them: lines starting with # are
// comments; an image takes two lines, of which the second (its observations) may be empty or missing.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/error.h"
#include "core/files/files.h"
#include "core/words.h"
#include "stereo/sfm/model/camera_models.h"
#include "stereo/sfm/model/model_files.h"
#include "stereo/sfm/view_list.h"

namespace polarscan {
namespace {

using Words = std::vector<std::string_view>;

constexpr const char* kBlanks = " \t\r\v\f";
constexpr const char* kCameraLine = "a camera is a line CAMERA_ID MODEL WIDTH HEIGHT PARAMETERS...";
constexpr const char* kImageLine =
    "an image is a line IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then a line of its observations, which "
    "may be empty or missing";
constexpr const char* kPointLine =
    "a point is a line POINT3D_ID X Y Z R G B ERROR, then pairs of IMAGE_ID POINT2D_IDX";

Words Split(std::string_view line) {
  Words words;
  for (std::size_t at = line.find_first_not_of(kBlanks); at != line.npos;
       at = line.find_first_not_of(kBlanks, at)) {
    const std::size_t end = std::min(line.find_first_of(kBlanks, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = end;
  }
  return words;
}

// The lines of a file, without comments and a byte order mark; empty lines count.
class Lines {
 public:
  // `form`: what a line holds, for messages.
  Lines(const std::filesystem::path& path, const char* form)
      : path_(path), form_(form), text_(ReadFile(path)) {
    if (text_.starts_with("\xef\xbb\xbf")) position_ = 3;
    if (text_.starts_with("\xff\xfe") || text_.starts_with("\xfe\xff"))
      throw Error("this file is UTF-16", path.string(), "Save it as UTF-8 or plain text");
  }

  bool Next() {
    while (position_ < text_.size()) {
      const std::size_t end = std::min(text_.find('\n', position_), text_.size());
      line_ = std::string_view(text_).substr(position_, end - position_);
      position_ = end + 1;
      ++number_;
      words_ = Split(line_);
      if (!words_.empty() && words_[0].starts_with('#')) continue;
      return true;
    }
    return false;
  }
  // The line is given once more.
  void Back() {
    position_ = std::size_t(line_.data() - text_.data());
    --number_;
  }
  std::string_view line() const { return line_; }
  const Words& words() const { return words_; }

  // The word as a number; whole numbers may be written as 3.0 or 3e0.
  double Number(std::size_t index) const {
    const auto value = index < words_.size() ? ToNumber<double>(words_[index]) : std::nullopt;
    if (!value) Fail();
    return *value;
  }
  template <class T>
  T Whole(std::size_t index) const {
    if (const auto exact = index < words_.size() ? ToNumber<T>(words_[index]) : std::nullopt) return *exact;
    const double value = Number(index);
    if (!(std::abs(value) < 9e15) || value != std::floor(value) ||
        value < double(std::numeric_limits<T>::min()) || value > double(std::numeric_limits<T>::max()))
      Fail();
    return T(value);
  }
  // Words that begin a comment at the line's end, and all after them, do not count.
  void DropComment() {
    const auto comment = std::ranges::find_if(words_, [](auto word) { return word.starts_with('#'); });
    words_.erase(comment, words_.end());
  }
  [[noreturn]] void Fail(const std::string& why = "it cannot be read") const {
    throw Error(fmt::format("line {} of the COLMAP model is not right: {} (\"{}\")", number_, why,
                            Excerpt(line_.substr(0, line_.find('\r')))),
                path_.string(), fmt::format("Mind: {}", form_));
  }

 private:
  std::filesystem::path path_;
  const char* form_;
  std::string text_;
  std::string_view line_;
  Words words_;
  std::size_t position_ = 0;
  int number_ = 0;
};

ColmapCamera ParseCamera(Lines& lines) {
  lines.DropComment();
  ColmapCamera camera;
  camera.id = lines.Whole<std::uint32_t>(0);
  if (lines.words().size() < 4) lines.Fail();
  for (const char c : lines.words()[1]) camera.model += char(std::toupper(static_cast<unsigned char>(c)));
  camera.width = lines.Whole<int>(2);
  camera.height = lines.Whole<int>(3);
  for (std::size_t i = 4; i < lines.words().size(); ++i) camera.params.push_back(lines.Number(i));
  if (camera.width <= 0 || camera.height <= 0) lines.Fail("the size is impossible");
  const CameraModel* model = FindCameraModel(camera.model);
  if (model && model->parameters != int(camera.params.size()))
    lines.Fail(fmt::format("{} takes {} parameters, these are {}", camera.model, model->parameters,
                           camera.params.size()));
  return camera;
}

// "a.png", but not "a" or "a.b c".
bool HasExtension(std::string_view name) {
  const std::size_t dot = name.rfind('.');
  return dot < name.size() - 1 && name.find_first_of(kBlanks, dot) == name.npos;
}

std::string_view WithoutBlanksBehind(std::string_view text) {
  return text.substr(0, text.find_last_not_of(kBlanks) + 1);
}

// The rest of an image's line: the name, which may hold blanks and #, without a comment after its extension.
std::string ParseName(const Lines& lines) {
  const std::string_view name =
      WithoutBlanksBehind(lines.line().substr(std::size_t(lines.words()[9].data() - lines.line().data())));
  for (std::size_t at = name.find('#'); at != name.npos; at = name.find('#', at + 1)) {
    const std::string_view before = WithoutBlanksBehind(name.substr(0, at));
    if (before.size() < at && HasExtension(before)) return std::string(before);
  }
  return std::string(name);
}

ColmapImage ParseImage(const Lines& lines, std::vector<std::string>& stretched) {
  ColmapImage image;
  image.id = lines.Whole<std::uint32_t>(0);
  double pose[7];
  for (std::size_t i = 0; i < 7; ++i) pose[i] = lines.Number(i + 1);
  image.camera_id = lines.Whole<std::uint32_t>(8);
  if (lines.words().size() < 10) lines.Fail("the name is missing");
  if (!SetPose(pose, image.cam_from_world)) lines.Fail("the pose is no rotation and translation");
  image.name = ParseName(lines);
  if (IsStretched(pose)) stretched.push_back(image.name);
  return image;
}

// Whether the line can be an image's observations: triples of numbers. (An image's own line has ten words, or
// words that are none, and so have the lines of an image whose observations were left out.)
bool HoldsObservations(const Words& words) {
  return words.size() % 3 == 0 &&
         std::ranges::all_of(words, [](auto word) { return ToNumber<double>(word).has_value(); });
}

void ParseObservations(Lines& lines, ColmapImage& image) {
  lines.DropComment();
  if (!HoldsObservations(lines.words())) return lines.Back();
  for (std::size_t i = 0; i < lines.words().size(); i += 3) {
    const bool none = lines.words()[i + 2] == "18446744073709551615";  // -1, as some write it
    image.observations.push_back(
        {lines.Number(i), lines.Number(i + 1), none ? -1 : lines.Whole<std::int64_t>(i + 2)});
  }
}

void ParsePoint(Lines& lines, SparseModel& model) {
  lines.DropComment();
  ColmapPoint point;
  for (int i = 0; i < 3; ++i) point.position[i] = lines.Number(std::size_t(i) + 1);
  for (std::size_t i = 0; i < 3; ++i) point.rgb[i] = std::uint8_t(lines.Whole<int>(i + 4));
  point.error_px = lines.Number(7);
  if (lines.words().size() % 2 != 0) lines.Fail("half an observation");
  for (std::size_t i = 8; i < lines.words().size(); i += 2)
    point.track.push_back({lines.Whole<std::uint32_t>(i), lines.Whole<std::uint32_t>(i + 1)});
  model.points[lines.Whole<std::uint64_t>(0)] = std::move(point);
}

void ReadCameras(const std::filesystem::path& path, SparseModel& model) {
  for (Lines lines(path, kCameraLine); lines.Next();) {
    if (lines.words().empty()) continue;
    const ColmapCamera camera = ParseCamera(lines);
    if (!model.cameras.emplace(camera.id, camera).second)
      lines.Fail(fmt::format("there is a camera {} already", camera.id));
  }
}

void ReadImages(const std::filesystem::path& path, SparseModel& model, std::vector<std::string>& notes) {
  std::vector<std::string> stretched;
  for (Lines lines(path, kImageLine); lines.Next();) {
    if (lines.words().empty()) continue;
    ColmapImage image = ParseImage(lines, stretched);
    if (model.images.contains(image.id))
      lines.Fail(fmt::format("there is an image {} already, {}", image.id, model.images.at(image.id).name));
    if (lines.Next()) ParseObservations(lines, image);
    model.images[image.id] = std::move(image);
  }
  AddNoteOnLengths(stretched, path, notes);
}

// Text is edited by hand: points may name images and observations that are no more.
void DropLostObservations(SparseModel& model) {
  for (auto& [id, point] : model.points)
    std::erase_if(point.track, [&](const ColmapPoint::Track& track) {
      const auto image = model.images.find(track.image_id);
      return image == model.images.end() || track.observation >= image->second.observations.size();
    });
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

SparseModel ReadTextModel(const std::filesystem::path& folder, std::vector<std::string>& notes) {
  SparseModel model;
  ReadCameras(folder / "cameras.txt", model);
  ReadImages(folder / "images.txt", model, notes);
  if (!std::filesystem::exists(folder / "points3D.txt")) return model;
  for (Lines lines(folder / "points3D.txt", kPointLine); lines.Next();)
    if (!lines.words().empty()) ParsePoint(lines, model);
  DropLostObservations(model);
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
