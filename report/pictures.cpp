// SPDX-License-Identifier: Apache-2.0
#include "report/pictures.h"

#include "core/error.h"
#include "core/formats/image_io.h"
#include "core/shrink.h"
#include "core/statistics.h"
#include "demosaic/false_colour.h"
#include "report/page_text.h"
#include "stereo/map_io.h"

namespace fs = std::filesystem;

namespace polarscan {
namespace {

constexpr int kQuality = 82;

// Calls read() if the file is there; a damaged one is remembered and does not stop the report.
template <class Read>
void TryRead(const fs::path& path, Thumbnails& view, Read&& read) {
  if (!fs::exists(path)) return;
  try {
    read();
  } catch (const Error& error) {
    view.damaged.push_back(error.what());
  }
}

StokesImage ShrinkStokes(const StokesImage& view, int longest) {
  const auto [width, height] = FitSize(view.s0.width(), view.s0.height(), longest);
  const auto use = [&](int x, int y) { return view.noise.empty() || std::isfinite(view.noise(x, y)); };
  const auto shrink = [&](const Image<float>& image) { return Shrink(image, width, height, 0.f, use); };
  return {shrink(view.s0), shrink(view.s1), shrink(view.s2), {}};  // S0 = 0 marks invalid pixels from here on
}

Image<Rgb8> ShrinkPicture(const Picture& picture, int longest) {
  const auto [width, height] = FitSize(picture.width(), picture.height(), longest);
  Image<Rgb8> small(width, height);
  const auto always = [](int, int) { return true; };
  std::vector<Image<float>> planes;
  for (const Image<float>& plane : picture.planes)
    planes.push_back(Shrink(plane, width, height, 0.f, always));
  const auto byte = [&](std::size_t plane, std::size_t i) {
    const float value = planes[std::min(plane, planes.size() - 1)].pixels()[i];
    return std::uint8_t(std::lround(std::clamp(value / picture.full_scale, 0.f, 1.f) * 255));
  };
  for (std::size_t i = 0; i < small.size(); ++i) small.pixels()[i] = {byte(0, i), byte(1, i), byte(2, i)};
  return small;
}

// S0 with the eye's gamma, for scans that have no 8-bit picture beside it.
Image<Rgb8> PictureOf(const StokesImage& view) {
  std::vector<double> s0(view.s0.pixels().begin(), view.s0.pixels().end());
  const double full = std::max(Quantile(s0, 0.99), 1e-9);
  Image<Rgb8> picture(view.s0.width(), view.s0.height(), kNoData);
  for (std::size_t i = 0; i < picture.size(); ++i)
    if (s0[i] > 0) {
      const auto grey = std::uint8_t(std::lround(255 * std::pow(std::min(1.0, s0[i] / full), 1 / 2.2)));
      picture.pixels()[i] = {grey, grey, grey};
    }
  return picture;
}

// S0 below which a pixel is too dark to tell anything of its polarization.
double Dark(std::span<const float> s0) {
  return 0.1 * Quantile(std::vector<double>(s0.begin(), s0.end()), 0.95);
}

double MedianDopNoise(const StokesImage& view) {
  const double dark = Dark(view.s0.pixels());
  std::vector<double> noise;
  for (std::size_t i = 0; i < view.noise.size(); ++i)
    if (view.s0.pixels()[i] > dark && std::isfinite(view.noise.pixels()[i]))
      noise.push_back(DegreeOfPolarizationNoise(view.s0.pixels()[i], view.noise.pixels()[i]));
  return Quantile(noise, 0.5);
}

// Of the pixels in the mask, where there is one that fits; else of all.
double ShareWithDepth(const Image<float>& depth, const Image<std::uint8_t>& mask) {
  std::size_t with_depth = 0, all = 0;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    if (!mask.empty() && !mask.pixels()[i]) continue;
    ++all;
    with_depth += depth.pixels()[i] > 0;
  }
  return double(with_depth) / double(std::max<std::size_t>(all, 1));
}

}  // namespace

void ReadSmall(Thumbnails& view, int longest) {
  TryRead(view.stokes_path, view, [&] {
    const StokesImage stokes = ReadStokes(view.stokes_path);
    view.dop_noise = MedianDopNoise(stokes);
    view.stokes = ShrinkStokes(stokes, longest);
  });
  const auto read_picture = [&](const fs::path& path, Image<Rgb8>& picture) {
    TryRead(path, view, [&] { picture = ShrinkPicture(ReadPicture(path), longest); });
  };
  read_picture(view.picture_path, view.picture);
  read_picture(view.depth_error_path, view.depth_error);
  read_picture(view.normal_error_path, view.normal_error);
  if (view.picture.empty() && view.stokes) view.picture = PictureOf(*view.stokes);
  TryRead(view.depth_path, view, [&] {
    const Image<float> depth = ReadDepthMap(view.depth_path);
    const auto [width, height] = FitSize(depth.width(), depth.height(), longest);
    Image<std::uint8_t> mask;
    TryRead(view.mask_path, view, [&] { mask = ReadMask(view.mask_path); });
    if (!SameSize(mask, depth)) mask = {};
    view.masked = !mask.empty();
    view.depth_share = ShareWithDepth(depth, mask);
    view.depth = Shrink(depth, width, height, 0.f, [&](int x, int y) { return depth(x, y) > 0; });
  });
  TryRead(view.normal_path, view, [&] {
    const Image<Eigen::Vector3f> normal = ReadNormalMap(view.normal_path);
    const auto [width, height] = FitSize(normal.width(), normal.height(), longest);
    const Eigen::Vector3f none = Eigen::Vector3f::Zero();
    view.normal = Shrink(normal, width, height, none, [&](int x, int y) { return !normal(x, y).isZero(); });
    for (Eigen::Vector3f& n : view.normal.pixels()) n.normalize();
  });
}

void AppendDop(const StokesImage& small, std::vector<double>& dop) {
  const auto s0 = small.s0.pixels();
  const double dark = Dark(s0);
  for (std::size_t i = 0; i < s0.size(); ++i)
    if (s0[i] > dark) dop.push_back(std::hypot(small.s1.pixels()[i], small.s2.pixels()[i]) / s0[i]);
}

nlohmann::json ToPage(const Thumbnails& view, double dop_full) {
  const auto jpeg = [](const Image<Rgb8>& image) { return Base64(EncodeJpeg(image, kQuality)); };
  nlohmann::json page = {{"name", view.name}, {"pictures", nlohmann::json::object()}};
  nlohmann::json& pictures = page["pictures"];
  if (!view.picture.empty()) pictures["s0"] = jpeg(view.picture);
  if (view.stokes && dop_full > 0) {
    pictures["dop"] = jpeg(DopPicture(*view.stokes, float(dop_full)));
    pictures["aop"] = jpeg(AopPicture(*view.stokes, float(dop_full)));
  }
  std::vector<double> depths;
  for (float z : view.depth.pixels())
    if (z > 0) depths.push_back(z);
  if (!view.depth.empty()) {
    const double near_depth = Quantile(depths, 0.02),
                 far_depth = std::max(Quantile(depths, 0.98), near_depth * 1.001);
    pictures["depth"] = jpeg(DepthPicture(view.depth, float(near_depth), float(far_depth)));
    page["depth"] = {
        {"near", near_depth}, {"far", far_depth}, {"share", view.depth_share}, {"masked", view.masked}};
  }
  if (!view.normal.empty()) pictures["normal"] = jpeg(NormalPicture(view.normal));
  if (!view.depth_error.empty()) pictures["depth_error"] = jpeg(view.depth_error);
  if (!view.normal_error.empty()) pictures["normal_error"] = jpeg(view.normal_error);
  return page;
}

}  // namespace polarscan
