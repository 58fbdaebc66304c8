// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/pose_conventions.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <optional>
#include <vector>

namespace polarscan {
namespace {

constexpr double kLeastSpread = 0.002;  // of the lines of sight: 4 degrees around their mean

struct Reading {
  bool quaternion = false, to_world = false, axes = false;
};

// The pose that was meant, if the numbers of `pose` were written that way.
Rigid Reread(const Rigid& pose, const Reading& reading) {
  Rigid meant = pose;
  if (reading.quaternion) {
    const Eigen::Quaterniond q(pose.rotation);
    meant.rotation = Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()).toRotationMatrix();
  }
  if (reading.to_world) meant = meant.Inverse();
  const Eigen::Matrix3d turn = Eigen::Vector3d(1, -1, -1).asDiagonal();
  return reading.axes ? Rigid{turn * meant.rotation, turn * meant.translation} : meant;
}

// How well lines of sight meet at one place.
struct Crossing {
  double miss = 0;      // of the place, root mean square, as a share of the mean distance to it
  double in_front = 0;  // share of the cameras
};

// None where the lines are nearly parallel.
std::optional<Crossing> Cross(const std::vector<Rigid>& poses) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const double count = double(poses.size());
  const auto across = [](const Rigid& pose) -> Eigen::Matrix3d {
    const Eigen::Vector3d sight = pose.rotation.row(2);
    return Eigen::Matrix3d::Identity() - sight * sight.transpose();
  };
  for (const Rigid& pose : poses) {
    sum += across(pose) / count;
    right += across(pose) * pose.Center() / count;
  }
  if (Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(sum).eigenvalues()[0] < kLeastSpread) return {};
  const Eigen::Vector3d place = sum.ldlt().solve(right);
  double squares = 0, distance = 0;
  Crossing crossing;
  for (const Rigid& pose : poses) {
    const Eigen::Vector3d way = place - pose.Center();
    squares += (across(pose) * way).squaredNorm() / count;
    distance += way.norm() / count;
    crossing.in_front += double(pose.rotation.row(2).dot(way) > 0) / count;
  }
  crossing.miss = std::sqrt(squares) / distance;
  return crossing;
}

std::string ReadingWords(const Reading& reading) {
  std::vector<std::string> words;
  if (reading.quaternion) words.push_back("their quaternions as x y z w");
  if (reading.to_world) words.push_back("the poses as those of the camera in the world (camera to world)");
  if (reading.axes) words.push_back("the cameras' axes as y up and z backward (OpenGL, Blender)");
  return fmt::format("{}", fmt::join(words, " and "));
}

}  // namespace

std::string OtherConvention(const SparseModel& model) {
  if (model.images.size() < 3 || !model.points.empty()) return "";
  std::vector<Rigid> given;  // as in the file: before the move to the local frame
  for (const auto& [id, image] : model.images) {
    const Rigid& pose = image.cam_from_world;
    given.push_back({pose.rotation, pose.translation - pose.rotation * model.offset});
  }
  const auto as_given = Cross(given);
  if (!as_given || (as_given->miss < 0.5 && as_given->in_front > 0.7)) return "";
  for (int k = 1; k < 8; ++k) {
    // Simple readings first: 1, 2 and 4 are one change each.
    constexpr int kOrder[] = {0, 1, 2, 4, 6, 3, 5, 7};
    const int bits = kOrder[k];
    const Reading reading{(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0};
    std::vector<Rigid> poses;
    for (const Rigid& pose : given) poses.push_back(Reread(pose, reading));
    const auto other = Cross(poses);
    if (other && other->miss < 0.2 && other->in_front > 0.999)
      return fmt::format(
          "the cameras of the known poses do not look at a common place; with {} they all would. Poses are "
          "cam_from_world, quaternions w x y z, a camera's axes x right, y down, z forward",
          ReadingWords(reading));
  }
  return "";
}

}  // namespace polarscan
