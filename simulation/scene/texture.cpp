// SPDX-License-Identifier: Apache-2.0
#include "simulation/scene/texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/random.h"

namespace polarscan {
namespace {

using Eigen::Vector2d;

constexpr int kLattice = 32;

double SmoothStep(double t) { return t * t * (3 - 2 * t); }

// A mark of the print: its outline as a signed distance (px, negative inside) around its own centre.
struct Mark {
  int kind = 0;
  double size = 0;
  std::array<Vector2d, 4> stroke;

  static double ToSegment(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
    const double t = std::clamp((p - a).dot(b - a) / std::max((b - a).squaredNorm(), 1e-9), 0.0, 1.0);
    return (p - a - t * (b - a)).norm();
  }
  double Scribble(const Vector2d& p) const {
    double d = 1e9;
    for (std::size_t i = 1; i < stroke.size(); ++i) d = std::min(d, ToSegment(p, stroke[i - 1], stroke[i]));
    return d - 0.12 * size - 1;
  }
  double Distance(const Vector2d& p) const {
    switch (kind) {
      case 0:
        return p.norm() - size;
      case 1:
        return std::abs(p.norm() - 0.8 * size) - 0.2 * size;
      case 2:
        return std::max(std::abs(p.x()) - size, std::abs(p.y()) - 0.6 * size);
      case 3:
        return std::max(-p.y() - 0.5 * size, 0.866 * std::abs(p.x()) + 0.5 * p.y() - 0.5 * size);
      default:
        return Scribble(p);
    }
  }
};

Mark RandomMark(Random& random) {
  Mark mark{int(random.Below(6)), 5 + 55 * std::pow(random.Uniform(), 3), {}};
  for (Vector2d& p : mark.stroke)
    p = mark.size * Vector2d(2 * random.Uniform() - 1, 2 * random.Uniform() - 1);
  return mark;
}

void Draw(Image<float>& picture, const Mark& mark, Random& random) {
  const Vector2d center(random.Uniform() * picture.width(), random.Uniform() * picture.height());
  const double turn = 2 * std::numbers::pi * random.Uniform(), reach = 1.5 * mark.size + 3;
  const float grey = 0.03f + 0.42f * float(random.Uniform());
  const Vector2d axis(std::cos(turn), std::sin(turn));
  const int x_end = std::min(picture.width() - 1, int(center.x() + reach));
  const int y_end = std::min(picture.height() - 1, int(center.y() + reach));
  for (int y = std::max(0, int(center.y() - reach)); y <= y_end; ++y)
    for (int x = std::max(0, int(center.x() - reach)); x <= x_end; ++x) {
      const Vector2d p = Vector2d(x + 0.5, y + 0.5) - center;
      const double d = mark.Distance({axis.dot(p), axis.x() * p.y() - axis.y() * p.x()});
      const float cover = float(std::clamp(0.5 - 0.7 * d, 0.0, 1.0));  // 0.7: an edge about 1.4 px wide
      picture(x, y) += cover * (grey - picture(x, y));
    }
}

}  // namespace

ValueNoise::ValueNoise(std::uint64_t seed) : lattice_(kLattice * kLattice * kLattice) {
  for (std::size_t i = 0; i < lattice_.size(); ++i) lattice_[i] = Random(seed, i).Uniform(-1.0f, 1.0f);
}

double ValueNoise::At(const Eigen::Vector3d& p) const {
  std::array<std::array<int, 2>, 3> cell;
  std::array<double, 3> t;
  for (int k = 0; k < 3; ++k) {
    const double floor = std::floor(p[k]);
    const int i = int(std::int64_t(floor) & (kLattice - 1));
    cell[std::size_t(k)] = {i, (i + 1) & (kLattice - 1)};
    t[std::size_t(k)] = SmoothStep(p[k] - floor);
  }
  const auto at = [&](std::size_t x, std::size_t y, std::size_t z) {
    return double(lattice_[std::size_t((cell[2][z] * kLattice + cell[1][y]) * kLattice + cell[0][x])]);
  };
  const auto along_x = [&](std::size_t y, std::size_t z) {
    return std::lerp(at(0, y, z), at(1, y, z), t[0]);
  };
  return std::lerp(std::lerp(along_x(0, 0), along_x(1, 0), t[1]),
                   std::lerp(along_x(0, 1), along_x(1, 1), t[1]), t[2]);
}

double ValueNoise::Fractal(const Eigen::Vector3d& p, int octaves) const {
  double sum = 0, weight = 1;
  Eigen::Vector3d q = p;
  for (int i = 0; i < octaves; ++i) {
    sum += weight * At(q);
    q = 2 * q + Eigen::Vector3d(7.3, 3.1, 5.7);
    weight *= 0.7;
  }
  return std::clamp(sum, -1.0, 1.0);
}

double SolidTexture::At(const Eigen::Vector3d& p) const {
  if (contrast == 0) return mean;
  double weight = contrast;
  if (patches) weight *= std::clamp(10 * noise.At(1.7 * p + Eigen::Vector3d(11, 5, 3)), 0.0, 1.0);
  return weight == 0 ? mean : std::clamp(mean + weight * noise.Fractal(5 * p, 4), 0.02, 0.9);
}

Image<float> MakePrint(int size, std::uint64_t seed, const Progress& progress) {
  const ValueNoise noise(seed);
  Image<float> ground(size / 4, size / 4), picture(size, size);
  for (int y = 0; y < ground.height(); ++y) {
    progress.Check();
    for (int x = 0; x < ground.width(); ++x) {
      const Eigen::Vector3d p(x * 24.0 / ground.width(), y * 24.0 / ground.height(), 0.5);
      ground(x, y) = 0.26f + 0.05f * float(noise.Fractal(p, 4));
    }
  }
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) picture(x, y) = Sample(ground, (x + 0.5) / size, (y + 0.5) / size);
  const int marks = size * size / 1300;
  for (int i = 0; i < marks; ++i) {
    progress.Check();
    Random random(seed, 1, std::uint64_t(i));
    const Mark mark = RandomMark(random);
    Draw(picture, mark, random);
  }
  return picture;
}

Image<float> Shrink(const Image<float>& image, int factor) {
  Image<float> small(image.width() / factor, image.height() / factor);
  for (int y = 0; y < small.height() * factor; ++y)
    for (int x = 0; x < small.width() * factor; ++x) small(x / factor, y / factor) += image(x, y);
  for (float& value : small.pixels()) value /= float(factor * factor);
  return small;
}

float Sample(const Image<float>& image, double u, double v) {
  const double x = std::clamp(u * image.width() - 0.5, 0.0, image.width() - 1.0);
  const double y = std::clamp(v * image.height() - 0.5, 0.0, image.height() - 1.0);
  const int x0 = std::min(int(x), image.width() - 2), y0 = std::min(int(y), image.height() - 2);
  const float tx = float(x - x0), ty = float(y - y0);
  const float* top = image.row(y0) + x0;
  const float* bottom = image.row(y0 + 1) + x0;
  return (1 - ty) * (top[0] + tx * (top[1] - top[0])) + ty * (bottom[0] + tx * (bottom[1] - bottom[0]));
}

}  // namespace polarscan
