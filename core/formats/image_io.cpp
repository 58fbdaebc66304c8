// SPDX-License-Identifier: Apache-2.0
#include "core/formats/image_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <optional>

#include "core/error.h"
#include "core/files/files.h"
#include "core/formats/exr.h"
#include "core/formats/npy.h"
#include "core/formats/picture_header.h"
#include "core/formats/picture_tags.h"
#include "core/words.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostInflated = 1100;  // bytes out of one byte: deflate's limit is 1032
constexpr int kLargestSide = 1 << 16;          // px
constexpr const char* kNoPicture = "the picture cannot be decoded (damaged or of another kind)";

// OpenCV fills the missing part of a truncated JPEG with grey and says nothing; the end marks tell. By what
// the bytes are, whatever the file is called.
bool IsTruncated(const std::string& bytes) {
  const auto ends_with = [&](const char* mark, std::size_t within) {
    return bytes.find(mark, bytes.size() - std::min(bytes.size(), within)) != std::string::npos;
  };
  if (bytes.starts_with("\x89PNG")) return !ends_with("IEND", 64);
  if (bytes.starts_with("\xFF\xD8\xFF")) return !ends_with("\xFF\xD9", 4096);
  return false;
}

// OpenCV decodes whatever it knows, some of it by programs of others (GDAL), and whatever the file is called.
bool IsPicture(const std::string& bytes) {
  static const std::string kBeginnings[] = {
      "\x89PNG", "\xFF\xD8\xFF", {"II*\0", 4}, {"MM\0*", 4}, {"II+\0", 4}, {"MM\0+", 4}, {"v/1\1", 4},
      "BM",      "P2",           "P3",         "P5",         "P6",         "#?"};
  return std::ranges::any_of(kBeginnings,
                             [&](const std::string& beginning) { return bytes.starts_with(beginning); });
}

// A TIFF's pixels as they are stored: its tag Orientation, which OpenCV would follow, says "upright" then.
void ForgetOrientation(std::string& bytes) {
  const std::optional<std::size_t> place = OrientationPlace(bytes);
  if (!place) return;
  const bool big = bytes.starts_with("MM");
  bytes[*place] = big ? 0 : 1, bytes[*place + 1] = big ? 1 : 0;
}

cv::Mat Decode(const fs::path& path) {
  std::string bytes = ReadFile(path);
  const std::string advice = "Copy the file again from where it came, or remove it";
  if (bytes.empty()) throw Error("the picture file is empty", path.string(), advice);
  const PictureHeader header = HeaderOf(path, bytes);
  if (!IsPicture(bytes)) throw Error(kNoPicture, path.string(), advice);
  if (IsTruncated(bytes) || bytes.size() < header.least_bytes)
    throw Error("the picture file is cut off before its end", path.string(), advice);
  const auto check_size = [&](std::uint64_t pixels) {  // a cut JPEG is grey from there on
    if (pixels > 8 * kMostInflated * bytes.size())
      throw Error("the picture file promises more pixels than it can hold", path.string(), advice);
  };
  check_size(header.Pixels());  // before OpenCV takes memory for them
  if (std::max(header.width, header.height) > kLargestSide)
    throw Error(fmt::format("a picture of {} x {} pixels is not read", header.width, header.height),
                path.string(), fmt::format("At most {} a side are", kLargestSide));
  ::setenv("OPENCV_IO_ENABLE_OPENEXR", "1", 0);  // OpenCV refuses EXR otherwise
  ForgetOrientation(bytes);
  const cv::Mat encoded(1, int(bytes.size()), CV_8U, bytes.data());
  cv::Mat image;
  try {
    image = cv::imdecode(encoded, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {  // its words are of its own source
    throw Error(kNoPicture, path.string(), advice);
  }
  if (image.empty()) throw Error(kNoPicture, path.string(), advice);
  check_size(image.total());
  return image;
}

// The last of four channels, if any of it is transparent.
template <class T>
Image<float> AlphaOf(const cv::Mat& image, float opaque) {
  if (image.channels() != 4) return {};
  Image<float> alpha(image.cols, image.rows);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) alpha(x, y) = float(image.ptr<T>(y)[4 * x + 3]);
  return std::ranges::all_of(alpha.pixels(), [&](float a) { return a >= opaque; }) ? Image<float>() : alpha;
}

// Planes in red, green, blue order from OpenCV's interleaved blue, green, red.
template <class T>
void SplitPlanes(const cv::Mat& image, Picture& picture) {
  const int channels = image.channels(), colours = channels >= 3 ? 3 : 1;
  picture.alpha = AlphaOf<T>(image, picture.full_scale);
  picture.planes.assign(std::size_t(colours), Image<float>(image.cols, image.rows));
  for (int y = 0; y < image.rows; ++y) {
    const T* in = image.ptr<T>(y);
    for (int c = 0; c < colours; ++c) {
      float* out = picture.planes[std::size_t(c)].row(y);
      const int from = colours == 3 ? 2 - c : 0;
      for (int x = 0; x < image.cols; ++x) out[x] = float(in[x * channels + from]);
    }
  }
}

void WriteEncoded(const fs::path& path, const cv::Mat& image, const char* extension = ".png") {
  std::vector<unsigned char> bytes;
  if (!cv::imencode(extension, image, bytes)) throw Error("cannot encode the picture", path.string());
  WriteFileAtomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

cv::Mat ToBgr(const Image<Rgb8>& image) {
  cv::Mat bgr(image.height(), image.width(), CV_8UC3);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) {
      const Rgb8 p = image(x, y);
      bgr.at<cv::Vec3b>(y, x) = {p.b, p.g, p.r};
    }
  return bgr;
}

constexpr float kJpegNoise = 16;  // of 255, near black

// The largest of each pixel's colours; 0 where that is no number.
Image<float> Brightest(const Picture& picture) {
  Image<float> brightest(picture.width(), picture.height());
  for (const Image<float>& plane : picture.planes)
    for (std::size_t i = 0; i < plane.size(); ++i)
      brightest.pixels()[i] = std::max(brightest.pixels()[i], plane.pixels()[i]);
  return brightest;
}

bool HoldsMoreValuesThan(std::size_t most, const Image<float>& values) {
  std::vector<float> seen;
  for (const float value : values.pixels())
    if (std::ranges::find(seen, value) == seen.end()) {
      seen.push_back(value);
      if (seen.size() > most) return true;
    }
  return false;
}

// 255 where a value is above `black`, or, if the mask is a soft one, above half of the brightest; else 0.
Image<std::uint8_t> NotBlack(const Image<float>& values, float black) {
  constexpr std::size_t kMostLabels = 16;
  const float brightest = values.empty() ? 0 : *std::ranges::max_element(values.pixels());
  float least = std::min(black, brightest / 2);
  const auto above = [&](float limit) {
    return std::ranges::count_if(values.pixels(), [&](float value) { return value > limit; });
  };
  if (HoldsMoreValuesThan(kMostLabels, values) && 2 * above(0.9f * brightest) > above(least))
    least = brightest / 2;
  Image<std::uint8_t> mask(values.width(), values.height());
  std::ranges::transform(values.pixels(), mask.pixels().begin(),
                         [&](float value) { return std::uint8_t(value > least ? 255 : 0); });
  return mask;
}

Picture PictureOf(NpyArray array, const fs::path& path) {
  if (array.planes.size() != 1 && array.planes.size() != 3)
    throw Error(fmt::format("this picture has {} channels, not 1 or 3", array.planes.size()), path.string());
  return {std::move(array.planes), array.bits == 32 ? 1.0f : float((1 << array.bits) - 1), array.bits};
}

// An EXR file whose channels OpenCV does not know; none if it does.
std::optional<Picture> ReadNamedExr(const fs::path& path) {
  const std::vector<std::string> names = ExrChannels(path);
  const auto holds = [&](const char* name) { return std::ranges::find(names, name) != names.end(); };
  if (holds("Y") || (holds("R") && holds("G") && holds("B"))) return std::nullopt;
  if (names.size() == 1) return Picture{ReadExrChannels(path, names), 1, 32};
  throw Error(fmt::format("this EXR file has no picture in grey or colours, its channels are {}",
                          fmt::join(names, ", ")),
              path.string(), "Stokes pictures have the channels S0 S1 S2, or S0.R S0.G S0.B and so on");
}

}  // namespace

bool IsPictureName(const fs::path& path) {
  static const char* const kExtensions[] = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr",
                                            ".bmp", ".pgm", ".ppm",  ".pnm", ".hdr",  ".npy"};
  return std::ranges::find(kExtensions, LowerExtension(path)) != std::end(kExtensions);
}

bool IsGrey(const Picture& picture) {
  const auto same = [](float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); };
  return std::ranges::all_of(picture.planes, [&](const Image<float>& plane) {
    return std::ranges::equal(plane.pixels(), picture.planes[0].pixels(), same);
  });
}

Picture ReadPicture(const fs::path& path) {
  const std::string extension = LowerExtension(path);
  if (extension == ".npy") return PictureOf(ReadNpy(path), path);
  if (extension == ".exr" && fs::exists(path) && fs::file_size(path) > 0)
    if (std::optional<Picture> picture = ReadNamedExr(path)) return *picture;
  const cv::Mat image = Decode(path);
  Picture picture;
  switch (image.depth()) {
    case CV_8U:
      picture.full_scale = 255, picture.bits = 8;
      SplitPlanes<std::uint8_t>(image, picture);
      break;
    case CV_16U:
      picture.full_scale = 65535, picture.bits = 16;
      SplitPlanes<std::uint16_t>(image, picture);
      break;
    case CV_32F:
      picture.full_scale = 1, picture.bits = 32;
      SplitPlanes<float>(image, picture);
      break;
    default:
      throw Error("pictures must hold 8-bit, 16-bit or float32 values", path.string());
  }
  return picture;
}

Image<std::uint8_t> ReadMask(const fs::path& path) {
  const Picture picture = ReadPicture(path);
  if (Image<std::uint8_t> mask = MaskFromAlpha(picture); !mask.empty()) return mask;
  return NotBlack(Brightest(picture), LowerExtension(path).starts_with(".jp") ? kJpegNoise : 0);
}

Image<std::uint8_t> MaskFromAlpha(const Picture& picture) {
  if (picture.alpha.empty()) return {};
  Image<std::uint8_t> mask = NotBlack(picture.alpha, 0);
  const auto object = std::ranges::count(mask.pixels(), 255);
  return object == 0 || std::size_t(object) == mask.size() ? Image<std::uint8_t>() : mask;
}

void WritePng(const fs::path& path, const Image<std::uint8_t>& image) {
  WriteEncoded(path, cv::Mat(image.height(), image.width(), CV_8U, const_cast<std::uint8_t*>(image.row(0))));
}

void WritePng(const fs::path& path, const Image<std::uint16_t>& image) {
  WriteEncoded(path,
               cv::Mat(image.height(), image.width(), CV_16U, const_cast<std::uint16_t*>(image.row(0))));
}

void WriteTiff(const fs::path& path, const Image<std::uint16_t>& image) {
  WriteEncoded(path, cv::Mat(image.height(), image.width(), CV_16U, const_cast<std::uint16_t*>(image.row(0))),
               ".tiff");
}

void WritePng(const fs::path& path, const Image<Rgb8>& image) { WriteEncoded(path, ToBgr(image)); }

std::string EncodeJpeg(const Image<Rgb8>& image, int quality) {
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", ToBgr(image), bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
  return {bytes.begin(), bytes.end()};
}

}  // namespace polarscan
