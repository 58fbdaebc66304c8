// SPDX-License-Identifier: Apache-2.0
#include "toy_scan.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "demosaic/stokes.h"
#include "fusion/cloud/cloud.h"
#include "stereo/map_io.h"
#include "stereo/workspace.h"

namespace polarscan::test {
namespace {

using Eigen::Vector3d;

struct Hit {
  double distance;  // along the direction as given
  Vector3d normal;
  Rgb8 colour;
};

// World: y up; the ball's centre is the origin, the table is y = -1 within 2.2 of the axis.
std::optional<Hit> Cast(const Vector3d& origin, const Vector3d& direction) {
  const double a = direction.squaredNorm(), b = origin.dot(direction), c = origin.squaredNorm() - 1;
  if (b * b > a * c) {
    const double distance = (-b - std::sqrt(b * b - a * c)) / a;
    const Vector3d normal = origin + distance * direction;
    const bool stripe = int(std::floor((std::atan2(normal.z(), normal.x()) / std::numbers::pi + 1) * 8)) % 2;
    return Hit{distance, normal, stripe ? Rgb8{214, 92, 60} : Rgb8{236, 222, 196}};
  }
  const double distance = -(origin.y() + 1) / direction.y();
  const Vector3d place = origin + distance * direction;
  if (distance <= 0 || std::hypot(place.x(), place.z()) > 2.2) return std::nullopt;
  const bool odd = int(std::floor(place.x() * 2) + std::floor(place.z() * 2)) & 1;
  return Hit{distance, Vector3d::UnitY(), odd ? Rgb8{70, 104, 140} : Rgb8{150, 176, 196}};
}

Rigid LookAtOrigin(const Vector3d& from) {
  Rigid pose;
  const Vector3d z = -from.normalized(), x = z.cross(Vector3d::UnitY()).normalized();
  pose.rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  pose.translation = -(pose.rotation * from);
  return pose;
}

struct Maps {
  Image<Rgb8> picture;
  StokesImage stokes;
  Image<float> depth;
  Image<Eigen::Vector3f> normal;
};

Maps Render(const DenseView& view, std::vector<CloudPoint>& cloud) {
  const Pinhole& camera = view.camera;
  const int w = camera.width, h = camera.height;
  Maps maps{
      Image<Rgb8>(w, h, Rgb8{24, 26, 30}),
      {Image<float>(w, h, 0.02f), Image<float>(w, h, 0), Image<float>(w, h, 0), Image<float>(w, h, 1e-3f)},
      Image<float>(w, h, 0),
      Image<Eigen::Vector3f>(w, h, Eigen::Vector3f::Zero())};
  const Rigid world_from_cam = view.cam_from_world.Inverse();
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const Vector3d ray = camera.Ray(x + 0.5, y + 0.5);
      const auto hit = Cast(world_from_cam.translation, world_from_cam.rotation * ray);
      if (!hit) continue;
      const Vector3d n = view.cam_from_world.rotation * hit->normal;
      const double slant = 1 - std::pow(n.dot(ray.normalized()), 2);
      const double azimuth = std::atan2(-(n.y() - n.z() * ray.y()), n.x() - n.z() * ray.x());
      const double light = 0.35 + 0.65 * std::max(0.0, hit->normal.dot(Vector3d(1, 3, 2).normalized()));
      const double dop = 0.35 * slant * slant,
                   s0 = light * (hit->colour.r + hit->colour.g + hit->colour.b) / 765;
      maps.stokes.s0(x, y) = float(s0);
      maps.stokes.s1(x, y) = float(s0 * dop * std::cos(2 * azimuth));
      maps.stokes.s2(x, y) = float(s0 * dop * std::sin(2 * azimuth));
      maps.depth(x, y) = float(hit->distance);  // the ray has z = 1
      maps.normal(x, y) = n.cast<float>();
      const auto shade = [&](int value) { return std::uint8_t(value * light); };
      maps.picture(x, y) = {shade(hit->colour.r), shade(hit->colour.g), shade(hit->colour.b)};
      const Vector3d place = world_from_cam * (hit->distance * ray);
      cloud.push_back({place.cast<float>(), hit->normal.cast<float>(), maps.picture(x, y), float(dop),
                       float(0.4 + 0.6 * (1 - slant)), std::uint16_t(3 + 9 * (1 - slant))});
    }
  return maps;
}

nlohmann::json ScanJson(int views, std::size_t points) {
  const auto stage = [](double seconds, nlohmann::json counts) {
    return nlohmann::json{
        {"state", "done"}, {"seconds", seconds}, {"counts", counts}, {"warnings", nlohmann::json::array()}};
  };
  return {{"version", "0.1.0"},
          {"input", "/data/ball"},
          {"options_hash", "0123456789abcdef"},
          {"options",
           {{"stereo", {{"preset", "default"}, {"polarization", true}, {"window-radius", 5}}},
            {"fusion", {{"min-views", 3}, {"max-depth-error", 0.01}}}}},
          {"stages",
           {{"views", stage(12.4, {{"views", views}})},
            {"sfm", stage(95, {{"registered", views}})},
            {"dense", stage(8.1, {{"views", views}})},
            {"stereo", stage(412, {{"depth maps", views}})},
            {"fusion", stage(21.5, {{"points", points}})}}},
          {"views", {{"total", views + 1}, {"registered", views}, {"polarized", true}}},
          {"cloud", {{"points", points}}},
          {"warnings", {"One view did not register: <ball> & table"}}};
}

}  // namespace

void WriteToyScan(const std::filesystem::path& folder, int views, int width, int height) {
  Workspace workspace{folder / "dense", {}, true};
  for (int i = 0; i < views; ++i) {
    const double angle = 2 * std::numbers::pi * i / views, f = 1.1 * width;
    DenseView view;
    view.name = std::string("ball") + char('0' + i / 10) + char('0' + i % 10);
    view.camera = {width, height, f, f, width / 2.0, height / 2.0};
    view.cam_from_world = LookAtOrigin({5.2 * std::sin(angle), 2.6, 5.2 * std::cos(angle)});
    view.depth_min = 3, view.depth_max = 9;
    view.sources = {(i + 1) % views, (i + views - 1) % views};
    workspace.views.push_back(view);
  }
  std::vector<CloudPoint> cloud;
  for (int i = 0; i < views; ++i) {
    const Maps maps = Render(workspace.views[std::size_t(i)], cloud);
    WritePng(workspace.PicturePath(i), maps.picture);
    WriteStokes(workspace.StokesPath(i), maps.stokes);
    WriteDepthMap(workspace.DepthPath(i, kFinalMaps), maps.depth);
    WriteNormalMap(workspace.NormalPath(i, kFinalMaps), maps.normal);
  }
  WriteWorkspace(workspace);
  WriteCloud(folder / "cloud.ply", cloud);
  WriteJson(folder / "scan.json", ScanJson(views, cloud.size()));
}

TriangleMesh Ball() {
  constexpr std::uint32_t kRings = 36, kSpokes = 72;
  TriangleMesh ball;
  for (std::uint32_t ring = 0; ring <= kRings; ++ring)
    for (std::uint32_t spoke = 0; spoke < kSpokes; ++spoke) {
      const double polar = M_PI * ring / kRings, around = 2 * M_PI * spoke / kSpokes;
      ball.vertices.emplace_back(std::sin(polar) * std::cos(around), std::cos(polar),
                                 -std::sin(polar) * std::sin(around));
      ball.normals.push_back(ball.vertices.back());
    }
  for (std::uint32_t ring = 0; ring < kRings; ++ring)
    for (std::uint32_t spoke = 0; spoke < kSpokes; ++spoke) {
      const std::uint32_t a = ring * kSpokes + spoke, b = ring * kSpokes + (spoke + 1) % kSpokes;
      ball.triangles.push_back({a, a + kSpokes, b});
      ball.triangles.push_back({b, a + kSpokes, b + kSpokes});
    }
  return ball;
}

}  // namespace polarscan::test
