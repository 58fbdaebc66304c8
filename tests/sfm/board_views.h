// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <functional>

#include "board/board.h"
#include "core/random.h"
#include "helpers.h"
#include "stereo/sfm/board/board_points.h"

namespace polarscan {

// How a picture of a board is made.
struct BoardShot {
  Board board = StandardBoards()[0];
  double blur_px = 0.7, noise = 0.01;
  bool mirrored = false;                                      // the print
  std::function<bool(double x_mm, double y_mm)> hidden = {};  // places of the board that something grey hides
  std::uint64_t seed = 1;
};

// A lens of 640 x 480 px with barrel distortion.
inline Lens ShotLens() { return {{640, 480, 700, 700, 322, 238}, -0.08, 0, 0, 0}; }

// From `elevation_deg` above the board, looking at its middle.
inline Rigid BoardCam(double turn_deg, double elevation_deg, double distance_mm) {
  const double t = turn_deg * M_PI / 180, e = elevation_deg * M_PI / 180;
  return LookAt(
      distance_mm * Eigen::Vector3d(std::cos(t) * std::cos(e), std::sin(t) * std::cos(e), std::sin(e)),
      {0, 0, 0}, {0, 0, 1});
}

inline Image<float> Blurred(const Image<float>& picture, double sigma) {
  const int reach = int(3 * sigma + 1);
  const auto pass = [&](const Image<float>& in, int dx, int dy) {
    Image<float> out(in.width(), in.height());
    for (int y = 0; y < in.height(); ++y)
      for (int x = 0; x < in.width(); ++x) {
        double sum = 0, weights = 0;
        for (int k = -reach; k <= reach; ++k) {
          if (!in.Contains(x + k * dx, y + k * dy)) continue;
          const double w = std::exp(-0.5 * k * k / (sigma * sigma));
          sum += w * in(x + k * dx, y + k * dy), weights += w;
        }
        out(x, y) = float(sum / weights);
      }
    return out;
  };
  return pass(pass(picture, 1, 0), 0, 1);
}

// S0 of the board, 4 x 4 rays a pixel, on a grey ground.
inline Image<float> Shoot(const BoardShot& shot, const BoardCamera& camera) {
  constexpr double kPixelsPerMm = 8;
  constexpr int kRays = 4;
  const Image<float> print = BoardPicture(shot.board, kPixelsPerMm);
  const Pinhole& p = camera.lens.pinhole;
  const Rigid world_from_cam = camera.cam_from_world.Inverse();
  Image<float> picture(p.width, p.height);
  const auto along = [&](double u, double v) {
    const Eigen::Vector2d n = camera.lens.Undistort({(u - p.cx) / p.fx, (v - p.cy) / p.fy});
    const Eigen::Vector3d ray = world_from_cam.rotation * Eigen::Vector3d(n.x(), n.y(), 1);
    const Eigen::Vector3d origin = world_from_cam.translation;
    const double t = -origin.z() / ray.z();
    const Eigen::Vector3d at = origin + t * ray;
    if (!(t > 0) || (shot.hidden && shot.hidden(at.x(), at.y()))) return 0.3f;
    const double x = shot.mirrored ? -at.x() : at.x();
    return 0.05f + 0.6f * Bilinear(print, 0.5 * print.width() + kPixelsPerMm * x,
                                   0.5 * print.height() - kPixelsPerMm * at.y())
                              .value_or(0.4f);
  };
  for (int y = 0; y < p.height; ++y)
    for (int x = 0; x < p.width; ++x) {
      float sum = 0;
      for (int i = 0; i < kRays * kRays; ++i)
        sum += along(x + (i % kRays + 0.5) / kRays, y + (i / kRays + 0.5) / kRays);
      picture(x, y) = sum / (kRays * kRays);
    }
  picture = Blurred(picture, shot.blur_px);
  Random random(shot.seed, 77);
  for (float& value : picture.pixels()) value += float(shot.noise * random.Normal());
  return picture;
}

}  // namespace polarscan
