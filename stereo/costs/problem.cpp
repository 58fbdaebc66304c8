// SPDX-License-Identifier: Apache-2.0
#include "stereo/costs/problem.h"

namespace polarscan {

Source MakeSource(const StereoView& reference, std::shared_ptr<const StereoView> view,
                  std::shared_ptr<const DepthNormalMap> map) {
  const Rigid relative = view->cam_from_world * reference.cam_from_world.Inverse();
  const Eigen::Matrix3d K = view->camera.K();
  Source source;
  source.rotation = relative.rotation.cast<float>();
  source.translation = relative.translation.cast<float>();
  source.center = relative.Center().cast<float>();
  const Eigen::Matrix3f pixels = (K * relative.rotation * reference.camera.K().inverse()).cast<float>();
  source.pixel_du = pixels.col(0), source.pixel_dv = pixels.col(1);
  source.pixel_translation = (K * relative.translation).cast<float>();
  source.fx = float(view->camera.fx), source.fy = float(view->camera.fy);
  source.cx = float(view->camera.cx), source.cy = float(view->camera.cy);
  source.view = std::move(view);
  source.map = std::move(map);
  return source;
}

Warp PlaneWarp(const Pinhole& reference, const Source& source, const Eigen::Vector3f& ray,
               const Eigen::Vector3f& turned_ray, const Hypothesis& hypothesis) {
  // n . X = c on the plane, so x_source = (R + t n^T / c) X; with X ~ K_r^-1 (u, v, 1) the homography's
  // columns are those of K_s R K_r^-1 plus K_s t times n^T K_r^-1 / c. At the pixel itself K_r^-1 (u, v, 1)
  // is the ray, and n . ray / c = 1 / depth.
  const Eigen::Vector3f& n = hypothesis.normal;
  const float scale = 1 / (hypothesis.depth * n.dot(ray));
  const float nx = n.x() / float(reference.fx) * scale, ny = n.y() / float(reference.fy) * scale;
  const Eigen::Vector3f& m = source.pixel_translation;
  const Eigen::Vector3f there(source.fx * turned_ray.x() + source.cx * turned_ray.z(),
                              source.fy * turned_ray.y() + source.cy * turned_ray.z(), turned_ray.z());
  const Eigen::Vector3f at = there + m / hypothesis.depth;
  const Eigen::Vector3f du = source.pixel_du + m * nx, dv = source.pixel_dv + m * ny;
  return {at.x(), du.x(), dv.x(), at.y(), du.y(), dv.y(), at.z(), du.z(), dv.z()};
}

}  // namespace polarscan
