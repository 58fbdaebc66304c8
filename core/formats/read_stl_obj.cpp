// SPDX-License-Identifier: Apache-2.0
#include "core/formats/read_stl_obj.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>

#include "core/error.h"
#include "core/words.h"

namespace polarscan {
namespace {

constexpr const char* kExportMesh = "Copy or export the file again";
constexpr std::string_view kBlank = " \t\r\n\f\v";
constexpr std::size_t kStlHeader = 84, kStlFacet = 50;  // bytes

// The first word of the text, which is cut off; empty at its end.
std::string_view TakeWord(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(kBlank), text.size()));
  const std::string_view word = text.substr(0, text.find_first_of(kBlank));
  text.remove_prefix(word.size());
  return word;
}

// Three numbers of the text, which are cut off; nothing if they are none, or not finite.
std::optional<Eigen::Vector3d> TakePoint(std::string_view& text) {
  Eigen::Vector3d point;
  for (int i = 0; i < 3; ++i) {
    const std::optional<double> value = ToNumber<double>(TakeWord(text));
    if (!value || !std::isfinite(*value)) return {};
    point[i] = *value;
  }
  return point;
}

[[noreturn]] void DamagedMesh(const std::string& format, const std::string& why, const std::string& where) {
  throw Error(fmt::format("damaged {} ({})", format, why), where, kExportMesh);
}

// Binary files may begin with "solid" too, but then they hold zeros.
bool IsAsciiStl(const std::string& bytes) {
  const std::string begin = LowerCase(bytes.substr(0, 1024));
  return begin.substr(0, begin.find_first_of(kBlank)) == "solid" &&
         (begin.find("facet") != begin.npos || begin.find("endsolid") != begin.npos) &&
         begin.find('\0') == begin.npos;
}

TriangleCorners ParseAsciiStl(std::string_view text, const std::string& where) {
  TriangleCorners corners;
  std::size_t facets = 0;
  bool ended = false;
  for (std::string_view word; !(word = TakeWord(text)).empty();) {
    if (word == "facet") ++facets;
    if (word == "solid" || word == "endsolid") {
      ended = word == "endsolid";
      text.remove_prefix(std::min(text.find('\n'), text.size()));  // the solid's name
    }
    if (word != "vertex") continue;
    const std::optional<Eigen::Vector3d> point = TakePoint(text);
    if (!point) DamagedMesh("STL", fmt::format("facet {} has a corner that is no point", facets), where);
    corners.points.push_back(*point);
  }
  if (!ended) DamagedMesh("STL", "it ends too early", where);
  if (corners.points.size() != 3 * facets)
    DamagedMesh("STL", fmt::format("{} facets with {} corners", facets, corners.points.size()), where);
  return corners;
}

TriangleCorners ParseBinaryStl(std::string_view bytes, const std::string& where) {
  if (bytes.size() < kStlHeader) DamagedMesh("STL", "it ends too early", where);
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + kStlHeader - sizeof(count), sizeof(count));
  const std::size_t there = (bytes.size() - kStlHeader) / kStlFacet;
  if (count > there)
    DamagedMesh("STL", fmt::format("it should hold {} triangles and ends after {}", count, there), where);
  TriangleCorners corners;
  corners.points.reserve(3 * std::size_t(count));
  for (std::size_t i = 0; i < 3 * std::size_t(count); ++i) {
    float xyz[3];
    const std::size_t facet = kStlHeader + i / 3 * kStlFacet;
    std::memcpy(xyz, bytes.data() + facet + (1 + i % 3) * sizeof(xyz), sizeof(xyz));
    corners.points.emplace_back(xyz[0], xyz[1], xyz[2]);
    if (!corners.points.back().allFinite())
      DamagedMesh("STL", fmt::format("triangle {} has a corner that is no point", i / 3 + 1), where);
  }
  return corners;
}

// A corner of a face, as 7, 7/1, 7//3 or 7/1/3; from 1, or from the end if below 0. normal: -1, it has none.
struct ObjCorner {
  std::size_t point;
  std::ptrdiff_t normal;
};

class ObjReader {
 public:
  explicit ObjReader(const std::string& where) : where_(where) {}

  void Line(std::string_view line) {
    ++number_;
    const std::string_view word = TakeWord(line);
    if (word == "v") points_.push_back(Point(line));
    if (word == "vn") normals_.push_back(Point(line));
    if (word == "f") Face(line);
  }
  TriangleCorners Finish() {
    if (!all_have_normals_) corners_.normals.clear();
    return std::move(corners_);
  }

 private:
  [[noreturn]] void Fail(const std::string& why) const {
    DamagedMesh("OBJ", fmt::format("line {}: {}", number_, why), where_);
  }
  Eigen::Vector3d Point(std::string_view line) const {
    const std::optional<Eigen::Vector3d> point = TakePoint(line);
    if (!point) Fail("these are not three finite numbers");
    return *point;
  }
  std::size_t Index(std::string_view word, std::size_t count, const char* what) const {
    const std::optional<std::int64_t> index = ToNumber<std::int64_t>(word);
    if (!index) Fail(fmt::format("'{}' is no {}", Excerpt(word), what));
    const std::int64_t from_0 = *index < 0 ? std::int64_t(count) + *index : *index - 1;
    if (from_0 < 0 || from_0 >= std::int64_t(count))
      Fail(fmt::format("a face names {} {}, and {} are there so far", what, *index, count));
    return std::size_t(from_0);
  }
  ObjCorner Corner(std::string_view word) const {
    const std::size_t slash = word.find('/'), last = word.rfind('/');
    const bool has_normal = last != slash && last + 1 < word.size();
    return {Index(word.substr(0, slash), points_.size(), "vertex"),
            has_normal ? std::ptrdiff_t(Index(word.substr(last + 1), normals_.size(), "normal")) : -1};
  }
  void Face(std::string_view line) {
    std::vector<ObjCorner> corners;
    for (std::string_view word; !(word = TakeWord(line)).empty() && word[0] != '#';)
      corners.push_back(Corner(word));
    if (corners.size() < 3) Fail("a face of fewer than three vertices");
    for (std::size_t i = 2; i < corners.size(); ++i)
      for (const ObjCorner& corner : {corners[0], corners[i - 1], corners[i]}) Add(corner);
  }
  void Add(const ObjCorner& corner) {
    corners_.points.push_back(points_[corner.point]);
    if (corner.normal >= 0 && normals_[std::size_t(corner.normal)].norm() > 1e-12)
      corners_.normals.push_back(normals_[std::size_t(corner.normal)]);
    else
      all_have_normals_ = false;
  }

  const std::string& where_;
  std::size_t number_ = 0;
  std::vector<Eigen::Vector3d> points_, normals_;
  TriangleCorners corners_;
  bool all_have_normals_ = true;
};

}  // namespace

TriangleCorners ParseStl(const std::string& bytes, const std::string& where) {
  return IsAsciiStl(bytes) ? ParseAsciiStl(LowerCase(bytes), where) : ParseBinaryStl(bytes, where);
}

TriangleCorners ParseObj(const std::string& text, const std::string& where) {
  ObjReader reader(where);
  std::string joined;  // a line and those that it goes on in, after a backslash
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line = std::string_view(text).substr(begin, end - begin);
    if (line.ends_with('\r')) line.remove_suffix(1);
    begin = end + 1;
    const bool goes_on = line.ends_with('\\');
    joined.append(line.substr(0, line.size() - (goes_on ? 1 : 0)));
    if (goes_on) {
      joined += ' ';
      continue;
    }
    reader.Line(joined);
    joined.clear();
  }
  if (!joined.empty()) reader.Line(joined);
  return reader.Finish();
}

}  // namespace polarscan
