// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>

#include "core/camera.h"

namespace polarscan {

// Power reflectances of a smooth dielectric for the field across (s) and in (p) the plane of incidence
// (Fresnel; Born and Wolf 1.5.2). `cosine`: of the angle in the outer medium, 0..1; `ior` > 1: of the inner
// one.
struct Reflectance {
  double s = 0, p = 0;
};
Reflectance Fresnel(double cosine, double ior);

// Radiance that leaves a diffusing body of albedo rho per unit of irradiance that entered it, before the exit
// surface's transmittance: rho / (1 - rho F) / (pi ior^2), F the internal reflectance of diffuse light (Egan
// and Hilgeman 1973).
double BodyRadiance(double albedo, double ior);

// The picture-plane view of one ray, where angles of polarization are counted.
// (x, y): normalised pixel; directions given to it are in the camera frame.
// Convention (docs/conventions.md): the angle of a direction d is that of (d_x - d_z x, -(d_y - d_z y)),
// anticlockwise as displayed. A real lens turns field directions along with the ray instead; for directions
// across the ray the two differ by at most (1 - cos t)/2 rad at t off the axis, under 1 degree within 15
// degrees.
class PolarFrame {
 public:
  PolarFrame(double x, double y) : x_(x), y_(y) {}
  // (cos 2a, sin 2a) of the direction's angle a; zero for a direction along the ray.
  Eigen::Vector2d DoubleAngle(const Eigen::Vector3d& d) const;

 private:
  double x_, y_;
};

// Stokes vector (S0, S1, S2), radiance of S0 = total; polarizer at angle a passes (S0 + S1 cos 2a + S2 sin
// 2a)/2. Diffuse light of inner radiance `body` that leaves through the surface: polarized along the normal's
// azimuth.
Eigen::Vector3d DiffuseStokes(double body, double cosine, double ior, const Eigen::Vector2d& normal_angle);
// Unpolarized light `radiance` mirrored by a facet: polarized across the facet normal's azimuth.
Eigen::Vector3d SpecularStokes(double radiance, double cosine, double ior,
                               const Eigen::Vector2d& facet_angle);

// A place on the unit disc, from which a facet is made: radius sqrt(u1) at the angle pi u2 from the plane of
// incidence, on the one side of it (side 1) or the other (-1).
struct DiscPoint {
  double along, across;
  DiscPoint(double u1, double u2, int side);
};

// A facet normal of the GGX distribution as seen from `to_viewer` (Heitz, JCGT 2018). Unit vectors.
Eigen::Vector3d VisibleFacet(const Eigen::Vector3d& normal, const Eigen::Vector3d& to_viewer,
                             double roughness, const DiscPoint& point);
// Share of facets that light leaving at this cosine to the normal does not find hidden (Smith's G1 for GGX).
double Unmasked(double cosine, double roughness);

}  // namespace polarscan
