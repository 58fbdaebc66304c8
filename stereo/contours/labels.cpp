// SPDX-License-Identifier: Apache-2.0
#include "stereo/contours/labels.h"

#include <algorithm>
#include <cmath>

#include "stereo/costs/normal_from_aop.h"

namespace polarscan {
namespace {

// By how much a pixel's neighbours want it to be diffuse, in units of energy; negative: specular.
struct Messages {
  float left = 0, right = 0, above = 0, below = 0;
  float Sum() const { return left + right + above + below; }
};

class LabelGraph {
 public:
  LabelGraph(const Problem& problem, const Image<Eigen::Vector3f>& normals, const LabelOptions& options)
      : width_(normals.width()),
        height_(normals.height()),
        own_(width_, height_),
        right_(width_, height_),
        below_(width_, height_),
        messages_(width_, height_) {
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x)
        if (problem.Active(x, y)) SetPixel(problem, normals(x, y), options, x, y);
  }

  void SweepThere() {
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        const float half = Wish(x, y) / 2;
        if (x + 1 < width_) messages_(x + 1, y).left = Send(half - messages_(x, y).right, right_(x, y));
        if (y + 1 < height_) messages_(x, y + 1).above = Send(half - messages_(x, y).below, below_(x, y));
      }
  }

  void SweepBack() {
    for (int y = height_ - 1; y >= 0; --y)
      for (int x = width_ - 1; x >= 0; --x) {
        const float half = Wish(x, y) / 2;
        if (x > 0) messages_(x - 1, y).right = Send(half - messages_(x, y).left, right_(x - 1, y));
        if (y > 0) messages_(x, y - 1).below = Send(half - messages_(x, y).above, below_(x, y - 1));
      }
  }

  // Above 0: diffuse.
  float Wish(int x, int y) const { return own_(x, y) + messages_(x, y).Sum(); }

 private:
  void SetPixel(const Problem& problem, const Eigen::Vector3f& normal, const LabelOptions& options, int x,
                int y) {
    const PolarSample& here = problem.reference->polar(x, y);
    const Eigen::Vector3f ray = problem.Ray(x, y);
    const AopConstraint constraint = MakeAopConstraint(here, ray.x(), ray.y());
    const float diffuse = constraint.diffuse.dot(normal), specular = constraint.specular.dot(normal);
    const float tilt = diffuse * diffuse + specular * specular + AopTable::kLeastTilt;
    own_(x, y) = options.diffuse +
                 here.weight * (specular * specular - diffuse * diffuse) / tilt;  // 0 of a zero normal
    const auto link = [&](int u, int v) {
      if (u >= width_ || v >= height_ || !problem.Active(u, v)) return 0.0f;
      const PolarSample& there = problem.reference->polar(u, v);
      const float cosine = here.cos_phi * there.cos_phi + here.sin_phi * there.sin_phi;
      return options.smoothness * std::min(here.weight, there.weight) * (2 * cosine * cosine - 1);
    };
    right_(x, y) = link(x + 1, y);
    below_(x, y) = link(x, y + 1);
  }

  // What a pixel that wishes so much tells a neighbour; link: what different labels cost more than the same one.
  static float Send(float wish, float link) {
    const float most = std::abs(link), passed = std::clamp(wish, -most, most);
    return link < 0 ? -passed : passed;
  }

  const int width_, height_;
  Image<float> own_, right_, below_;
  Image<Messages> messages_;
};

}  // namespace

Image<Reflection> LabelReflection(const Problem& problem, const Image<Eigen::Vector3f>& normals,
                                  const LabelOptions& options) {
  LabelGraph graph(problem, normals, options);
  for (int i = 0; i < options.sweeps; ++i) {
    graph.SweepThere();
    graph.SweepBack();
  }
  Image<Reflection> labels(normals.width(), normals.height());
  for (int y = 0; y < labels.height(); ++y)
    for (int x = 0; x < labels.width(); ++x)
      labels(x, y) = graph.Wish(x, y) < 0 ? Reflection::kSpecular : Reflection::kDiffuse;
  return labels;
}

}  // namespace polarscan
