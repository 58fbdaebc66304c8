// SPDX-License-Identifier: Apache-2.0
#include "simulation/renderer/lit_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/parallel.h"

namespace polarscan {
namespace {

using Eigen::Vector3d;

constexpr double kLift = 5e-4;  // rays start this far above a surface
constexpr int kObjectDirections = 96, kTableDirections = 64, kOpenDirections = 512;
constexpr int kTableTexels = 256, kInterleave = 4;

struct Beam {
  Vector3d direction;
  double radiance, solid_angle;
};

// Directions spread evenly over the sphere (Fibonacci lattice) between heights low and high; `phase` in [0,
// 1) shifts the lattice.
std::vector<Beam> EvenBeams(const Scene& scene, int count, double low, double phase) {
  std::vector<Beam> beams;
  for (int i = 0; i < count; ++i) {
    const double y = 1 - (1 - low) * (i + phase) / count;
    const double radius = std::sqrt(std::max(0.0, 1 - y * y)),
                 turn = 2 * std::numbers::pi * (i * std::numbers::phi + phase);
    const Vector3d d(radius * std::sin(turn), y, radius * std::cos(turn));
    beams.push_back({d, scene.LampLight(d), 2 * std::numbers::pi * (1 - low) / count});
  }
  return beams;
}

double Transmittance(double cosine, double ior) {
  const Reflectance r = Fresnel(cosine, ior);
  return 1 - 0.5 * (r.s + r.p);
}

// Whether the ray comes near the object or a block at all.
bool NearSolids(const Scene& scene, const Vector3d& origin, const Vector3d& direction) {
  const double along = origin.dot(direction),
               outside = origin.squaredNorm() - 1.0001 * scene.reach * scene.reach;
  return outside < 0 || (along < 0 && along * along > outside);
}

// Distance to the table's top, 0 if the ray does not meet it from above.
double TableDistance(const Scene& scene, const Vector3d& origin, const Vector3d& direction) {
  const double height = origin.y() - scene.table_height;
  if (!scene.has_table || direction.y() >= 0 || height <= 0) return 0;
  const double distance = -height / direction.y(), s = scene.table_half_size;
  const double x = origin.x() + distance * direction.x(), z = origin.z() + distance * direction.z();
  return std::abs(x) < s && std::abs(z) < s ? distance : 0;
}

double TableBody(const LitScene& lit, const Vector3d& p, bool coarse) {
  const double s = 2 * lit.scene.table_half_size;
  return BodyRadiance(lit.scene.PrintAt(p, Vector3d::UnitY(), coarse), lit.scene.table_material.ior) *
         Sample(lit.table_light, 0.5 + p.x() / s, 0.5 + p.z() / s);
}

// Light that enters one point of the table.
double LightOnTable(const LitScene& lit, const Vector3d& p, const std::vector<Beam>& beams) {
  const double ior = lit.scene.table_material.ior;
  double sum = 0;
  for (const Beam& beam : beams) {
    const bool hidden = NearSolids(lit.scene, p, beam.direction) && lit.solids.Occluded(p, beam.direction);
    const double radiance = hidden ? lit.object_glow : beam.radiance;
    sum += beam.solid_angle * beam.direction.y() * radiance * Transmittance(beam.direction.y(), ior);
  }
  return sum;
}

// Mean of the n x n texels around each.
Image<float> BoxBlur(const Image<float>& image, int n) {
  Image<float> out(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) {
      float sum = 0;
      for (int k = 0; k < n * n; ++k)
        sum += image(std::clamp(x + k % n - n / 2, 0, image.width() - 1),
                     std::clamp(y + k / n - n / 2, 0, image.height() - 1));
      out(x, y) = sum / float(n * n);
    }
  return out;
}

// Neighbouring texels use different directions; a blur over one period of them puts all together (interleaved
// sampling, Keller and Heidrich 2001).
Image<float> LightTable(const LitScene& lit, Progress& progress) {
  if (!lit.scene.has_table) return {};
  constexpr int kPhases = kInterleave * kInterleave;
  std::vector<std::vector<Beam>> beams;
  for (int k = 0; k < kPhases; ++k)
    beams.push_back(EvenBeams(lit.scene, kTableDirections, 0.0, (k + 0.5) / kPhases));
  Image<float> light(kTableTexels, kTableTexels);
  const double s = lit.scene.table_half_size;
  ParallelFor(0, kTableTexels, [&](int y) {
    progress.Check();
    for (int x = 0; x < kTableTexels; ++x) {
      const Vector3d p(s * (2 * (x + 0.5) / kTableTexels - 1), lit.scene.table_height + kLift,
                       s * (2 * (y + 0.5) / kTableTexels - 1));
      const int phase = (5 * (x % kInterleave) + 7 * kInterleave * (y % kInterleave)) % kPhases;
      light(x, y) = float(LightOnTable(lit, p, beams[std::size_t(phase)]));
    }
  });
  return BoxBlur(light, kInterleave);
}

// Light that enters a plane of this normal from all around, with nothing in the way.
double OpenLight(const Vector3d& normal, const std::vector<Beam>& beams, double ior) {
  double sum = 0;
  for (const Beam& beam : beams) {
    const double cosine = normal.dot(beam.direction);
    if (cosine > 0) sum += beam.solid_angle * cosine * beam.radiance * Transmittance(cosine, ior);
  }
  return sum;
}

// The same at a vertex of a solid, with the solids and the table in the way, as a share of OpenLight.
double LightShare(const LitScene& lit, const Vector3d& vertex, const Vector3d& normal, double ior,
                  const std::vector<Beam>& beams) {
  const Vector3d p = vertex + kLift * normal;
  double met = 0, open = 0;
  for (const Beam& beam : beams) {
    const double cosine = normal.dot(beam.direction);
    if (cosine <= 0) continue;
    double radiance = beam.radiance;
    if (lit.solids.Occluded(p, beam.direction)) {
      radiance = lit.object_glow;
    } else if (const double d = TableDistance(lit.scene, p, beam.direction); d > 0) {
      radiance = TableBody(lit, p + d * beam.direction, true) *
                 Transmittance(-beam.direction.y(), lit.scene.table_material.ior);
    }
    const double weight = cosine * Transmittance(cosine, ior);
    met += weight * radiance;
    open += weight * beam.radiance;
  }
  return open > 0 ? met / open : 0;
}

// Each vertex's mean with its neighbours, `rounds` times.
void Smooth(const TriangleMesh& mesh, int rounds, std::vector<float>& values) {
  for (int round = 0; round < rounds; ++round) {
    std::vector<float> sum = values, count(values.size(), 1.0f);
    for (const auto& t : mesh.triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        sum[t[k]] += values[t[(k + 1) % 3]] + values[t[(k + 2) % 3]];
        count[t[k]] += 2;
      }
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = sum[i] / count[i];
  }
}

// OpenLight is known for every normal and needs no rays; only the share of it that arrives is sampled, with
// few and different directions at neighbouring vertices, and smoothed.
std::vector<float> LightSolid(const LitScene& lit, const TriangleMesh& mesh, double ior, Progress& progress) {
  constexpr int kPhases = 16, kRounds = 3;
  std::vector<std::vector<Beam>> beams;
  for (int k = 0; k < kPhases; ++k)
    beams.push_back(EvenBeams(lit.scene, kObjectDirections, -1.0, (k + 0.5) / kPhases));
  std::vector<float> light(mesh.vertices.size());
  ParallelFor(0, int(light.size()), [&](int i) {
    progress.Check();
    const auto k = std::size_t(i);
    light[k] =
        float(LightShare(lit, mesh.vertices[k], mesh.normals[k], ior, beams[std::size_t(i * 7 % kPhases)]));
  });
  Smooth(mesh, kRounds, light);
  const std::vector<Beam> all = EvenBeams(lit.scene, kOpenDirections, -1.0, 0.5);
  ParallelFor(0, int(light.size()), [&](int i) {
    progress.Check();
    light[std::size_t(i)] *= float(OpenLight(mesh.normals[std::size_t(i)], all, ior));
  });
  return light;
}

// Inner radiance of an object in the open, at the mean light over all directions.
double MeanGlow(const Scene& scene) {
  double light = 0;
  for (const Beam& beam : EvenBeams(scene, kOpenDirections, -1.0, 0.5))
    light += beam.radiance * beam.solid_angle / 4;  // the mean of max(0, n d) over n is 1/4
  return BodyRadiance(scene.object_texture.mean, scene.object_material.ior) * light;
}

Meeting MeetSolid(const LitScene& lit, const Vector3d& origin, const Vector3d& direction,
                  const RayCaster::Hit& hit, bool coarse) {
  const Scene& scene = lit.scene;
  const bool object = hit.mesh == 0;
  const auto& t = (object ? scene.object : scene.blocks).triangles[std::size_t(hit.triangle)];
  const std::vector<float>& light = lit.solid_light[std::size_t(hit.mesh)];
  const double here = (1 - hit.u - hit.v) * light[t[0]] + hit.u * light[t[1]] + hit.v * light[t[2]];
  Meeting m{object ? Meeting::kObject : Meeting::kTable,
            hit.distance,
            origin + hit.distance * direction,
            lit.solids.Normal(hit),
            0,
            object ? &scene.object_material : &scene.table_material};
  double albedo = scene.object_texture.mean;
  if (!object) albedo = scene.PrintAt(m.point, m.normal, coarse);
  if (object && !coarse) albedo = scene.object_texture.At(m.point);
  m.body = BodyRadiance(albedo, m.material->ior) * here;
  return m;
}

// What a reflected ray sees, taken as unpolarized.
double IncomingRadiance(const LitScene& lit, const Vector3d& origin, const Vector3d& direction) {
  const Meeting m = Meet(lit, origin, direction, true);
  if (m.thing == Meeting::kNothing) return lit.scene.LampLight(direction);
  return m.body * Transmittance(std::clamp(-m.normal.dot(direction), 0.02, 1.0), m.material->ior);
}

// A shading normal that looks away from the viewer (at silhouettes) is bent just into view; its azimuth
// stays.
Vector3d FacingNormal(const Vector3d& normal, const Vector3d& to_viewer) {
  constexpr double kLeast = 0.02;
  const double cosine = normal.dot(to_viewer);
  return cosine >= kLeast ? normal : Vector3d((normal + (kLeast - cosine) * to_viewer).normalized());
}

}  // namespace

LitScene Illuminate(Scene scene, Progress& progress) {
  RayCaster caster({scene.object, scene.blocks});
  LitScene lit{std::move(scene), std::move(caster), {}, {}, 0};
  lit.object_glow = MeanGlow(lit.scene);
  lit.table_light = LightTable(lit, progress);
  lit.solid_light = {LightSolid(lit, lit.scene.object, lit.scene.object_material.ior, progress),
                     LightSolid(lit, lit.scene.blocks, lit.scene.table_material.ior, progress)};
  return lit;
}

Meeting Meet(const LitScene& lit, const Vector3d& origin, const Vector3d& direction, bool coarse) {
  RayCaster::Hit hit;
  if (NearSolids(lit.scene, origin, direction)) hit = lit.solids.Cast(origin, direction);
  const double table = TableDistance(lit.scene, origin, direction);
  if (hit.mesh >= 0 && (table <= 0 || hit.distance < table))
    return MeetSolid(lit, origin, direction, hit, coarse);
  if (table <= 0) return {};
  const Vector3d p = origin + table * direction;
  return {Meeting::kTable, table, p, Vector3d::UnitY(), TableBody(lit, p, coarse), &lit.scene.table_material};
}

Vector3d StokesAlong(const LitScene& lit, const Vector3d& origin, const Vector3d& direction,
                     const Eigen::Matrix3d& cam_from_world, const PolarFrame& frame,
                     const FacetSamples& facets) {
  const Meeting m = Meet(lit, origin, direction, false);
  if (m.thing == Meeting::kNothing) return {lit.scene.RoomLight(direction), 0, 0};
  const Vector3d to_viewer = -direction, normal = FacingNormal(m.normal, to_viewer);
  const Material& material = *m.material;
  Vector3d specular = Vector3d::Zero();
  const std::vector<DiscPoint>& points = m.thing == Meeting::kObject ? facets.object : facets.table;
  for (const DiscPoint& point : points) {
    const Vector3d facet = VisibleFacet(normal, to_viewer, material.roughness, point);
    const double cosine = facet.dot(to_viewer);
    const Vector3d mirrored = 2 * cosine * facet - to_viewer;
    const double out = normal.dot(mirrored);
    if (out <= 0 || cosine <= 0) continue;
    const double radiance = IncomingRadiance(lit, m.point + kLift * m.normal, mirrored);
    specular += Unmasked(out, material.roughness) *
                SpecularStokes(radiance, cosine, material.ior, frame.DoubleAngle(cam_from_world * facet));
  }
  return specular / double(points.size()) + DiffuseStokes(m.body, normal.dot(to_viewer), material.ior,
                                                          frame.DoubleAngle(cam_from_world * normal));
}

}  // namespace polarscan
