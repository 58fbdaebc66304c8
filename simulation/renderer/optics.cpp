// SPDX-License-Identifier: Apache-2.0
#include "simulation/renderer/optics.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace polarscan {

using Eigen::Vector2d;
using Eigen::Vector3d;

Reflectance Fresnel(double cosine, double ior) {
  const double inner = std::sqrt(std::max(0.0, 1 - (1 - cosine * cosine) / (ior * ior)));
  const double s = (cosine - ior * inner) / (cosine + ior * inner);
  const double p = (ior * cosine - inner) / (ior * cosine + inner);
  return {s * s, p * p};
}

double BodyRadiance(double albedo, double ior) {
  const double internal = -1.440 / (ior * ior) + 0.710 / ior + 0.668 + 0.0636 * ior;
  return albedo / (1 - albedo * internal) / (std::numbers::pi * ior * ior);
}

Vector2d PolarFrame::DoubleAngle(const Vector3d& d) const {
  const double a = d.x() - d.z() * x_, b = -(d.y() - d.z() * y_);
  const double square = a * a + b * b;
  if (square < 1e-24) return Vector2d::Zero();
  return Vector2d(a * a - b * b, 2 * a * b) / square;
}

Vector3d DiffuseStokes(double body, double cosine, double ior, const Vector2d& normal_angle) {
  const Reflectance r = Fresnel(cosine, ior);
  const double total = body * (1 - 0.5 * (r.s + r.p)), along = body * 0.5 * (r.s - r.p);
  return {total, along * normal_angle.x(), along * normal_angle.y()};
}

Vector3d SpecularStokes(double radiance, double cosine, double ior, const Vector2d& facet_angle) {
  const Reflectance r = Fresnel(cosine, ior);
  const double total = radiance * 0.5 * (r.s + r.p), across = radiance * 0.5 * (r.s - r.p);
  return {total, -across * facet_angle.x(), -across * facet_angle.y()};
}

DiscPoint::DiscPoint(double u1, double u2, int side)
    : along(std::sqrt(u1) * std::cos(std::numbers::pi * u2)),
      across(side * std::sqrt(u1) * std::sin(std::numbers::pi * u2)) {}

Vector3d VisibleFacet(const Vector3d& normal, const Vector3d& to_viewer, double roughness,
                      const DiscPoint& point) {
  const double cosine = std::clamp(normal.dot(to_viewer), 0.0, 1.0), sine = std::sqrt(1 - cosine * cosine);
  // Local frame: x in the plane of incidence, z the normal.
  const Vector3d x_axis =
      sine > 1e-6 ? Vector3d((to_viewer - cosine * normal).normalized()) : normal.unitOrthogonal();
  const Vector3d y_axis = normal.cross(x_axis);
  const double length = std::sqrt(roughness * roughness * sine * sine + cosine * cosine);
  const double sx = roughness * sine / length, sz = cosine / length;  // the stretched view; its y is 0
  const double a = point.across, s = 0.5 * (1 + sz);
  const double b = (1 - s) * std::sqrt(1 - a * a) + s * point.along;
  const double c = std::sqrt(std::max(0.0, 1 - a * a - b * b));
  // a along y, b across the stretched view within the plane of incidence, c along it.
  const Vector3d facet(roughness * (c * sx - b * sz), roughness * a, std::max(1e-9, c * sz + b * sx));
  return (facet.x() * x_axis + facet.y() * y_axis + facet.z() * normal).normalized();
}

double Unmasked(double cosine, double roughness) {
  const double tangent2 = (1 - cosine * cosine) / (cosine * cosine);
  return 2 / (1 + std::sqrt(1 + roughness * roughness * tangent2));
}

}  // namespace polarscan
