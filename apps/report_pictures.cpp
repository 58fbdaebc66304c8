// SPDX-License-Identifier: Apache-2.0
#include "apps/report_pictures.h"

#include "apps/report_util.h"
#include "core/error.h"
#include "core/image_io.h"
#include "demosaic/false_colour.h"
#include "stereo/map_io.h"

namespace fs = std::filesystem;

namespace polarscan {
namespace {

constexpr int kQuality = 82;

// Calls read() if the file is there; a damaged one is remembered and does not stop the report.
template <class Read>
void TryRead(const fs::path& path, SmallView& view, Read&& read) {
  if (!fs::exists(path)) return;
  try {
    read();
  } catch (const Error& error) {
    view.damaged.push_back(error.what());
  }
}

// width and height with the longest side at most `longest`.
std::pair<int, int> FitSize(int width, int height, int longest) {
  const double scale = std::min(1.0, double(longest) / std::max(width, height));
  return {std::max(1, int(std::lround(width * scale))), std::max(1, int(std::lround(height * scale)))};
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

}  // namespace

void ReadSmall(SmallView& view, int longest) {
  TryRead(view.stokes_path, view, [&] { view.stokes = ShrinkStokes(ReadStokes(view.stokes_path), longest); });
  TryRead(view.picture_path, view,
          [&] { view.picture = ShrinkPicture(ReadPicture(view.picture_path), longest); });
  if (view.picture.empty() && view.stokes) view.picture = PictureOf(*view.stokes);
  TryRead(view.depth_path, view, [&] {
    const Image<float> depth = ReadDepthMap(view.depth_path);
    const auto [width, height] = FitSize(depth.width(), depth.height(), longest);
    const auto valid =
        std::count_if(depth.pixels().begin(), depth.pixels().end(), [](float z) { return z > 0; });
    view.depth_share = double(valid) / double(std::max<std::size_t>(depth.size(), 1));
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
  const std::vector<double> s0(small.s0.pixels().begin(), small.s0.pixels().end());
  const double dark = 0.1 * Quantile(s0, 0.95);
  for (std::size_t i = 0; i < s0.size(); ++i)
    if (s0[i] > dark) dop.push_back(std::hypot(small.s1.pixels()[i], small.s2.pixels()[i]) / s0[i]);
}

nlohmann::json ToPage(const SmallView& view, double dop_full) {
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
    page["depth"] = {{"near", near_depth}, {"far", far_depth}, {"share", view.depth_share}};
  }
  if (!view.normal.empty()) pictures["normal"] = jpeg(NormalPicture(view.normal));
  return page;
}

}  // namespace polarscan
