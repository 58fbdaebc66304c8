// SPDX-License-Identifier: Apache-2.0
#include "core/formats/ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>
#include <string_view>

#include "core/error.h"
#include "core/files/files.h"

namespace polarscan {
namespace {

enum class Type { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };
enum class Format { kAscii, kLittle, kBig };

struct Property {
  std::string name;
  Type type = Type::kFloat;
  std::optional<Type> count_type;  // set: a list
};
struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};
struct Header {
  Format format = Format::kAscii;
  std::vector<Element> elements;
};

[[noreturn]] void Damaged(const std::string& why) { throw Error("damaged PLY (" + why + ")", ""); }

std::size_t SizeOf(Type type) {
  constexpr std::size_t kSizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[std::size_t(type)];
}

Type ParseType(const std::string& word) {
  static constexpr const char* kOld[] = {"char", "uchar", "short", "ushort",
                                         "int",  "uint",  "float", "double"};
  static constexpr const char* kNew[] = {"int8",  "uint8",  "int16",   "uint16",
                                         "int32", "uint32", "float32", "float64"};
  for (int i = 0; i < 8; ++i)
    if (word == kOld[i] || word == kNew[i]) return Type(i);
  Damaged("unknown type '" + word + "'");
}

// The bytes of the file, read front to back; every step past the end is an error.
class Reader {
 public:
  Reader(std::string_view bytes) : rest_(bytes) {}

  std::size_t remaining() const { return rest_.size(); }
  void SetFormat(Format format) { format_ = format; }

  std::string Line() {
    const std::size_t end = rest_.find('\n');
    if (end == std::string_view::npos || end > 4096) Damaged("the header does not end");
    std::string line(rest_.substr(0, end));
    rest_.remove_prefix(end + 1);
    if (!line.empty() && line.back() == '\r') line.pop_back();
    return line;
  }

  double Number(Type type) { return format_ == Format::kAscii ? Ascii() : Binary(type); }

 private:
  double Ascii() {
    constexpr std::string_view kSpace = " \t\r\n";
    rest_.remove_prefix(std::min(rest_.find_first_not_of(kSpace), rest_.size()));
    const std::string_view word = rest_.substr(0, rest_.find_first_of(kSpace));
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || word.empty())
      Damaged(word.empty() ? "it ends too early" : "not a number");
    rest_.remove_prefix(word.size());
    return value;
  }

  double Binary(Type type) {
    switch (type) {
      case Type::kInt8:
        return Take<std::int8_t>();
      case Type::kUint8:
        return Take<std::uint8_t>();
      case Type::kInt16:
        return Take<std::int16_t>();
      case Type::kUint16:
        return Take<std::uint16_t>();
      case Type::kInt32:
        return Take<std::int32_t>();
      case Type::kUint32:
        return Take<std::uint32_t>();
      case Type::kFloat:
        return Take<float>();
      default:
        return Take<double>();
    }
  }

  template <class T>
  T Take() {
    if (rest_.size() < sizeof(T)) Damaged("it ends too early");
    char bytes[sizeof(T)];
    std::memcpy(bytes, rest_.data(), sizeof(T));
    if ((format_ == Format::kBig) != (std::endian::native == std::endian::big))
      std::reverse(bytes, bytes + sizeof(T));
    rest_.remove_prefix(sizeof(T));
    return std::bit_cast<T>(bytes);
  }

  std::string_view rest_;
  Format format_ = Format::kAscii;
};

std::size_t ParseCount(const std::string& word) {
  std::size_t count = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), count);
  if (error != std::errc() || end != word.data() + word.size()) Damaged("count '" + word + "'");
  return count;
}

Property ParseProperty(const std::vector<std::string>& words) {
  if (words.size() == 3) return {words[2], ParseType(words[1]), {}};
  if (words.size() != 5 || words[1] != "list") Damaged("a property line");
  const Type count_type = ParseType(words[2]);
  if (count_type == Type::kFloat || count_type == Type::kDouble)
    Damaged("a list length that is not an integer");
  return {words[4], ParseType(words[3]), count_type};
}

Format ParseFormat(const std::vector<std::string>& words) {
  if (words.size() == 3 && words[1] == "ascii") return Format::kAscii;
  if (words.size() == 3 && words[1] == "binary_little_endian") return Format::kLittle;
  if (words.size() == 3 && words[1] == "binary_big_endian") return Format::kBig;
  Damaged("unknown format");
}

std::vector<std::string> Words(const std::string& line) {
  std::istringstream stream(line);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

Header ReadHeader(Reader& reader) {
  if (reader.Line() != "ply") Damaged("it does not begin with 'ply'");
  Header header;
  bool has_format = false;
  for (;;) {
    const std::vector<std::string> words = Words(reader.Line());
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") break;
    if (words[0] == "format") {
      header.format = ParseFormat(words);
      has_format = true;
    } else if (words[0] == "element" && words.size() == 3) {
      header.elements.push_back({words[1], ParseCount(words[2]), {}});
    } else if (words[0] == "property" && !header.elements.empty()) {
      header.elements.back().properties.push_back(ParseProperty(words));
    } else {
      Damaged("header line '" + words[0] + "'");
    }
  }
  if (!has_format) Damaged("no format line");
  return header;
}

// The fewest bytes a row can take; in ascii a digit and a separator per number.
std::size_t SmallestRow(const Element& element, Format format) {
  std::size_t bytes = 0;
  for (const Property& p : element.properties)
    bytes += format == Format::kAscii ? 2 : SizeOf(p.count_type.value_or(p.type));
  return bytes;
}

std::size_t ListLength(Reader& reader, const Property& property, Format format) {
  const double length = reader.Number(*property.count_type);
  const std::size_t smallest = format == Format::kAscii ? 2 : SizeOf(property.type);
  if (!(length >= 0) || length != std::floor(length) || length > double(reader.remaining() / smallest + 1))
    Damaged("a list longer than the file");
  return std::size_t(length);
}

std::vector<std::uint32_t> ReadList(Reader& reader, const Property& property, Format format) {
  std::vector<std::uint32_t> row(ListLength(reader, property, format));
  for (std::uint32_t& item : row) {
    const double value = reader.Number(property.type);
    const bool valid = value >= 0 && value <= std::numeric_limits<std::uint32_t>::max();
    item = valid ? std::uint32_t(value) : std::numeric_limits<std::uint32_t>::max();
  }
  return row;
}

PlyElement ReadElement(Reader& reader, const Element& element, Format format) {
  const std::size_t smallest = SmallestRow(element, format);
  if (smallest == 0 || element.count > (reader.remaining() + 1) / smallest) {
    if (element.count > 0) Damaged(fmt::format("{} rows of '{}' do not fit", element.count, element.name));
    return {};
  }
  PlyElement result{element.count, {}, {}};
  std::vector<std::vector<double>*> columns;
  std::vector<std::vector<std::vector<std::uint32_t>>*> lists;
  for (const Property& p : element.properties) {
    if (result.columns.contains(p.name) || result.lists.contains(p.name)) Damaged("two '" + p.name + "'");
    columns.push_back(p.count_type ? nullptr : &result.columns[p.name]);
    lists.push_back(p.count_type ? &result.lists[p.name] : nullptr);
    if (p.count_type)
      lists.back()->reserve(element.count);
    else
      columns.back()->reserve(element.count);
  }
  for (std::size_t row = 0; row < element.count; ++row)
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const Property& p = element.properties[i];
      if (p.count_type)
        lists[i]->push_back(ReadList(reader, p, format));
      else
        columns[i]->push_back(reader.Number(p.type));
    }
  return result;
}

PlyFile Parse(std::string_view bytes) {
  Reader reader(bytes);
  const Header header = ReadHeader(reader);
  reader.SetFormat(header.format);
  PlyFile file;
  for (const Element& element : header.elements) {
    if (file.contains(element.name)) Damaged("two elements '" + element.name + "'");
    file[element.name] = ReadElement(reader, element, header.format);
  }
  return file;
}

}  // namespace

PlyFile ReadPly(const std::filesystem::path& path) {
  const std::string bytes = ReadFile(path);
  try {
    return Parse(bytes);
  } catch (const Error& error) {
    std::string what = error.what();
    throw Error(what.substr(0, what.rfind(": ")), path.string(), "Copy or export the file again");
  }
}

std::string PlyOffsetLine(const Eigen::Vector3d& offset) {
  if (offset.isZero(0)) return "";
  return fmt::format("comment offset {} {} {}\n", offset.x(), offset.y(), offset.z());
}

Eigen::Vector3d ReadPlyOffset(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string line;
  for (int lines = 0; lines < 100 && std::getline(file, line) && line != "end_header"; ++lines) {
    std::istringstream words(line);
    std::string comment, what;
    Eigen::Vector3d offset;
    if (words >> comment >> what >> offset.x() >> offset.y() >> offset.z() && comment == "comment" &&
        what == "offset" && offset.allFinite())
      return offset;
  }
  return Eigen::Vector3d::Zero();
}

}  // namespace polarscan
