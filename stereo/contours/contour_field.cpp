// SPDX-License-Identifier: Apache-2.0
#include "stereo/contours/contour_field.h"

#include <cmath>

#include "core/parallel.h"
#include "stereo/costs/hypotheses.h"

namespace polarscan {
namespace {

// Moving along m the point at `ray` goes so in the picture: (m_x - x m_z, m_y - y m_z) in normalised coordinates.
Eigen::Vector2f DoubledAt(const Problem& problem, Reflection label, int x, int y) {
  const Pinhole& camera = problem.reference->camera;
  const PolarSample& sample = problem.reference->polar(x, y);
  const Eigen::Vector3f ray = problem.Ray(x, y);
  const AopConstraint constraint = MakeAopConstraint(sample, ray.x(), ray.y());
  const Eigen::Vector3f& m = label == Reflection::kDiffuse ? constraint.diffuse : constraint.specular;
  const float dx = float(camera.fx) * (m.x() - ray.x() * m.z()),
              dy = float(camera.fy) * (m.y() - ray.y() * m.z());
  return sample.weight / (dx * dx + dy * dy) * Eigen::Vector2f(dx * dx - dy * dy, 2 * dx * dy);
}

Eigen::Vector2f Smoothed3x3(const Image<Eigen::Vector2f>& field, const Problem& problem, int x, int y) {
  Eigen::Vector2f sum = Eigen::Vector2f::Zero();
  float weights = 0;
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      if (!field.Contains(x + dx, y + dy) || !problem.Active(x + dx, y + dy)) continue;
      const float weight = float((2 - std::abs(dx)) * (2 - std::abs(dy)));
      sum += weight * field(x + dx, y + dy), weights += weight;
    }
  return sum / weights;
}

}  // namespace

ContourField::ContourField(const Problem& problem, const Image<Reflection>& labels)
    : doubled_(labels.width(), labels.height(), Eigen::Vector2f::Zero()) {
  Image<Eigen::Vector2f> single(labels.width(), labels.height(), Eigen::Vector2f::Zero());
  ParallelFor(0, labels.height(), [&](int y) {
    for (int x = 0; x < labels.width(); ++x)
      if (problem.Active(x, y)) single(x, y) = DoubledAt(problem, labels(x, y), x, y);
  });
  ParallelFor(0, labels.height(), [&](int y) {
    for (int x = 0; x < labels.width(); ++x)
      if (problem.Active(x, y)) doubled_(x, y) = Smoothed3x3(single, problem, x, y);
  });
}

Eigen::Vector2f ContourField::At(const Eigen::Vector2f& place) const {
  const int x = int(std::floor(place.x())), y = int(std::floor(place.y()));
  if (!doubled_.Contains(x, y) || !doubled_.Contains(x + 1, y + 1)) return Eigen::Vector2f::Zero();
  const float right = place.x() - float(x), low = place.y() - float(y);
  return (1 - low) * ((1 - right) * doubled_(x, y) + right * doubled_(x + 1, y)) +
         low * ((1 - right) * doubled_(x, y + 1) + right * doubled_(x + 1, y + 1));
}

Eigen::Vector2f ContourField::Direction(const Eigen::Vector2f& doubled) {
  const float cosine = doubled.x() / doubled.norm();
  return {std::sqrt(std::max(0.0f, (1 + cosine) / 2)),
          std::copysign(std::sqrt(std::max(0.0f, (1 - cosine) / 2)), doubled.y())};
}

Eigen::Vector3f ContourField::Tangent(const Problem& problem, int x, int y) const {
  const Eigen::Vector2f& doubled = doubled_(x, y);
  if (!(doubled.squaredNorm() > 0)) return Eigen::Vector3f::Zero();
  const Pinhole& camera = problem.reference->camera;
  const Eigen::Vector2f along = Direction(doubled);
  const Eigen::Vector3f ray = problem.Ray(x, y),
                        moved(along.x() / float(camera.fx), along.y() / float(camera.fy), 0);
  return (moved - moved.dot(ray) / ray.squaredNorm() * ray).normalized();
}

}  // namespace polarscan
