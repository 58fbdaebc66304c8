// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/resample.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace polarscan {
namespace {

constexpr float kWhole =
    0.9995f;  // the least bilinear weight is 1/1024, so below this some of it was invalid

struct Maps {
  cv::Mat x, y;  // source position of each pixel, in OpenCV's integer-centred coordinates
};

// The undistorted camera has the lens's focal lengths; only its distortion differs.
Maps MakeMaps(const Lens& lens) {
  const Pinhole& p = lens.pinhole;
  Maps maps{cv::Mat(p.height, p.width, CV_32F), cv::Mat(p.height, p.width, CV_32F)};
  for (int v = 0; v < p.height; ++v)
    for (int u = 0; u < p.width; ++u) {
      const Eigen::Vector2d distorted = lens.Distort(p.Ray(u + 0.5, v + 0.5).head<2>());
      maps.x.at<float>(v, u) = float(p.fx * distorted.x() + p.cx - 0.5);
      maps.y.at<float>(v, u) = float(p.fy * distorted.y() + p.cy - 0.5);
    }
  return maps;
}

cv::Mat AsMat(const Image<float>& image) {
  return cv::Mat(image.height(), image.width(), CV_32F, const_cast<float*>(image.row(0)));
}

// One plane through the whole way; outside counts as 0.
class Resampler {
 public:
  explicit Resampler(const Resampling& way) : way_(way) {
    if (!way.lens.IsPinhole()) maps_ = MakeMaps(way.lens);
  }

  Image<float> operator()(const Image<float>& image) const {
    cv::Mat plane = AsMat(image), straight;
    if (!maps_.x.empty()) {
      cv::remap(plane, straight, maps_.x, maps_.y, cv::INTER_LINEAR, cv::BORDER_CONSTANT, 0);
      plane = straight;
    }
    Image<float> result(way_.camera.width, way_.camera.height);
    cv::Mat out = AsMat(result);
    if (plane.size() == out.size()) {
      plane.copyTo(out);
    } else {
      cv::resize(plane, out, out.size(), 0, 0, cv::INTER_AREA);
    }
    return result;
  }

 private:
  Resampling way_;
  Maps maps_;
};

}  // namespace

bool Resampling::IsIdentity() const {
  return lens.IsPinhole() && camera.width == lens.pinhole.width && camera.height == lens.pinhole.height;
}

Resampling MakeResampling(const Lens& lens, int max_size) {
  Resampling way{lens, lens.pinhole};
  const int longest = std::max(lens.pinhole.width, lens.pinhole.height);
  if (max_size <= 0 || longest <= max_size) return way;
  const double scale = double(max_size) / longest;
  const int width = std::max(1, int(std::lround(lens.pinhole.width * scale)));
  const int height = std::max(1, int(std::lround(lens.pinhole.height * scale)));
  way.camera = lens.pinhole.Resized(width, height);
  return way;
}

StokesImage Resample(const StokesImage& image, const Resampling& way) {
  StokesImage clean = image;
  Image<float> valid(image.noise.width(), image.noise.height(), 1);
  for (std::size_t i = 0; i < valid.size(); ++i) {
    if (std::isfinite(image.noise.pixels()[i])) continue;
    valid.pixels()[i] = 0;
    for (Image<float>* plane : {&clean.s0, &clean.s1, &clean.s2, &clean.noise}) plane->pixels()[i] = 0;
  }
  const Resampler resample(way);
  StokesImage result{resample(clean.s0),    resample(clean.s1), resample(clean.s2),
                     resample(clean.noise), image.s0_noise,     image.independence};
  const Image<float> weight = resample(valid);
  AverageNoise(result, double(image.s0.size()) / double(result.s0.size()));
  for (std::size_t i = 0; i < weight.size(); ++i) {
    if (weight.pixels()[i] >= kWhole) continue;
    for (Image<float>* plane : {&result.s0, &result.s1, &result.s2}) plane->pixels()[i] = 0;
    result.noise.pixels()[i] = std::numeric_limits<float>::infinity();
  }
  return result;
}

Picture Resample(const Picture& picture, const Resampling& way) {
  const Resampler resample(way);
  Picture result = picture;
  for (Image<float>& plane : result.planes) plane = resample(plane);
  return result;
}

Image<std::uint8_t> Resample(const Image<std::uint8_t>& mask, const Resampling& way) {
  Image<float> plane(mask.width(), mask.height());
  for (std::size_t i = 0; i < plane.size(); ++i) plane.pixels()[i] = mask.pixels()[i] ? 1.f : 0.f;
  const Image<float> share = Resampler(way)(plane);
  Image<std::uint8_t> result(share.width(), share.height());
  for (std::size_t i = 0; i < share.size(); ++i) result.pixels()[i] = share.pixels()[i] >= 0.5f ? 255 : 0;
  return result;
}

}  // namespace polarscan
