// SPDX-License-Identifier: Apache-2.0
#include "stereo/rounds/normals.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>

#include "core/parallel.h"
#include "stereo/costs/normal_from_aop.h"

namespace polarscan {
namespace {

constexpr float kSame = 0.9994f;  // cosine (2 degrees) from which two starts end alike

constexpr int kNextPixels[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};

// n with n . ray = -1 from the slopes of log z per pixel; unit length.
Eigen::Vector3f NormalFromSlopes(const Pinhole& camera, const Eigen::Vector3f& ray, float along_x,
                                 float along_y) {
  const float nx = float(camera.fx) * along_x, ny = float(camera.fy) * along_y;
  return Eigen::Vector3f(nx, ny, -1 - nx * ray.x() - ny * ray.y()).normalized();
}

Eigen::Vector3f FitPlane(const Problem& problem, const Image<float>& depth, int x, int y) {
  const float steepest = 8 / float(problem.reference->camera.fx);  // of log z per pixel
  const float here = depth(x, y);
  float xx = 1e-3f, xy = 0, yy = 1e-3f, xw = 0, yw = 0;
  for (int dy = -2; dy <= 2; ++dy)
    for (int dx = -2; dx <= 2; ++dx) {
      if (!depth.Contains(x + dx, y + dy)) continue;
      const float there = depth(x + dx, y + dy);
      const float change = there / here - 1;
      if (there <= 0 || std::abs(change) > steepest * float(std::max(std::abs(dx), std::abs(dy)))) continue;
      const float w = change - 0.5f * change * change, fx = float(dx), fy = float(dy);
      xx += fx * fx, xy += fx * fy, yy += fy * fy, xw += fx * w, yw += fy * w;
    }
  const float det = xx * yy - xy * xy;
  return NormalFromSlopes(problem.reference->camera, problem.Ray(x, y), (xw * yy - yw * xy) / det,
                          (yw * xx - xw * xy) / det);
}

// All that is known about one pixel's normal.
struct NormalEvidence {
  AopTable aop;
  std::array<Eigen::Vector3f, 6> others;  // the depth map's normal, the other views' and the neighbours'
  std::array<float, 6> agreement{};
  std::size_t other_count = 0;
  Eigen::Vector3f consensus = Eigen::Vector3f::Zero();  // sum of the other views' normals
  Eigen::Matrix3f tangents = Eigen::Matrix3f::Zero();
  Eigen::Vector3f ray;
};

class NormalSolver {
 public:
  NormalSolver(const Problem& problem, const Image<float>& depth, const Image<Eigen::Vector3f>& start,
               const NormalOptions& options)
      : problem_(problem),
        depth_(depth),
        start_(start),
        options_(options),
        softness_(options.residual * options.residual) {}

  Eigen::Vector3f Solve(int x, int y, const Eigen::Vector3f& from_depth) const {
    NormalEvidence evidence;
    Gather(x, y, from_depth, evidence);
    if (evidence.aop.count == 0) return Improve(evidence, from_depth);  // all starts end alike
    Eigen::Vector3f best = start_(x, y);
    float least = 1e30f;
    std::array<Eigen::Vector3f, 7> seen;
    std::size_t seen_count = 0;
    const auto consider = [&](const Eigen::Vector3f& candidate) {
      for (std::size_t i = 0; i < seen_count; ++i)
        if (candidate.dot(seen[i]) > kSame) return;
      seen[seen_count++] = candidate;
      const Eigen::Vector3f normal = Improve(evidence, Improve(evidence, candidate));
      const float energy = Energy(evidence, normal);
      if (energy < least) least = energy, best = normal;
    };
    if (start_(x, y).squaredNorm() > 0.5f) consider(start_(x, y));
    for (std::size_t i = 0; i < evidence.other_count; ++i) consider(evidence.others[i]);
    return best;
  }

 private:
  void Gather(int x, int y, const Eigen::Vector3f& from_depth, NormalEvidence& evidence) const {
    evidence.ray = problem_.Ray(x, y);
    const float depth = depth_(x, y);
    const Eigen::Vector3f point = depth * evidence.ray;
    if (!problem_.reference->polar.empty()) {
      const PolarSample& own = problem_.reference->polar(x, y);
      if (own.weight > 0) evidence.aop.Add(MakeAopConstraint(own, evidence.ray.x(), evidence.ray.y()));
    }
    AddSources(point, evidence);
    evidence.aop.Pad();
    const auto add = [&](const Eigen::Vector3f& normal, float agreement) {
      evidence.others[evidence.other_count] = normal;
      evidence.agreement[evidence.other_count++] = agreement;
    };
    add(from_depth, options_.depth_normal);
    if (evidence.consensus.dot(evidence.ray) < 0) add(evidence.consensus.normalized(), options_.consensus);
    for (const auto& [dx, dy] : kNextPixels) {
      if (!depth_.Contains(x + dx, y + dy) || depth_(x + dx, y + dy) <= 0) continue;
      const Eigen::Vector3f there = depth_(x + dx, y + dy) * problem_.Ray(x + dx, y + dy);
      const Eigen::Vector3f along = (there - point).normalized();
      const float gap = (depth_(x + dx, y + dy) / depth - 1) * float(problem_.reference->camera.fx) / 4;
      evidence.tangents += options_.tangent / (1 + gap * gap) * along * along.transpose();
      if (start_(x + dx, y + dy).squaredNorm() > 0.5f)
        add(start_(x + dx, y + dy), options_.agreement / (1 + gap * gap));
    }
  }

  // A point as a source sees it, if it does.
  struct Look {
    const Source* source;
    float depth;
    Seen seen;
  };

  // First where all sources see the point, then what is there: memory is asked for all of it at once.
  void AddSources(const Eigen::Vector3f& point, NormalEvidence& evidence) const {
    std::array<Look, AopTable::kMost> looks;
    std::size_t count = 0;
    for (const Source& source : problem_.sources) {
      if (count == looks.size()) break;
      const Eigen::Vector3f there = source.rotation * point + source.translation;
      const Seen seen = LookAt(source, there);
      if (!seen.inside()) continue;
      __builtin_prefetch(&source.map->depth(seen.u, seen.v));
      __builtin_prefetch(&source.map->normal(seen.u, seen.v));
      if (!source.view->polar.empty()) __builtin_prefetch(&source.view->polar(seen.u, seen.v));
      looks[count++] = {&source, there.z(), seen};
    }
    for (std::size_t i = 0; i < count; ++i) AddLook(looks[i], evidence);
  }

  void AddLook(const Look& look, NormalEvidence& evidence) const {
    const Source& source = *look.source;
    const Seen& seen = look.seen;
    const float depth = source.map->depth(seen.u, seen.v);
    if (depth <= 0 || std::abs(look.depth - depth) > 4 * options_.sigma * depth) return;
    evidence.consensus += source.rotation.transpose() * source.map->normal(seen.u, seen.v);
    if (source.view->polar.empty()) return;
    const PolarSample& sample = source.view->polar(seen.u, seen.v);
    if (sample.weight <= 0) return;
    evidence.aop.Add(MakeAopConstraint(source, sample, seen));
  }

  // One step of re-weighted least squares: towards the smallest eigenvector, by inverse iteration.
  Eigen::Vector3f Improve(const NormalEvidence& evidence, const Eigen::Vector3f& normal) const {
    Eigen::Matrix3f sum = evidence.tangents + AopSystemSimd(evidence.aop, normal, softness_);
    sum.diagonal().array() += 1e-4f * sum.trace() + 1e-6f;
    const Eigen::Vector3f a = sum.col(0), b = sum.col(1), c = sum.col(2);
    Eigen::Matrix3f adjugate;  // symmetric: the inverse times the determinant
    adjugate << b.cross(c), c.cross(a), a.cross(b);
    Eigen::Vector3f better = normal;
    for (int i = 0; i < 3; ++i) better = (adjugate * better).normalized();
    if (!better.allFinite()) return normal;
    if (better.dot(evidence.ray) > 0) better = -better;
    return better.dot(evidence.ray) < -0.02f * evidence.ray.norm() ? better : normal;
  }

  float Energy(const NormalEvidence& evidence, const Eigen::Vector3f& normal) const {
    float energy = AopEnergySimd(evidence.aop, normal, softness_);
    for (std::size_t i = 0; i < evidence.other_count; ++i) {
      const float away = (normal - evidence.others[i]).squaredNorm();
      energy += evidence.agreement[i] * away / (away + softness_);
    }
    return energy;
  }

  const Problem& problem_;
  const Image<float>& depth_;
  const Image<Eigen::Vector3f>& start_;
  const NormalOptions& options_;
  const float softness_;
};

Eigen::Vector3f Smoothed(const Image<Eigen::Vector3f>& normals, int x, int y) {
  const Eigen::Vector3f& here = normals(x, y);
  Eigen::Vector3f sum = here;
  for (const auto& [dx, dy] : kNextPixels) {
    if (!normals.Contains(x + dx, y + dy)) continue;
    const Eigen::Vector3f& there = normals(x + dx, y + dy);
    const float away = (there - here).squaredNorm();
    if (there.squaredNorm() > 0.5f) sum += 0.5f / (1 + away / 0.01f) * there;
  }
  return sum.normalized();
}

}  // namespace

Image<Eigen::Vector3f> DepthNormals(const Problem& problem, const Image<float>& depth) {
  Image<Eigen::Vector3f> normals(depth.width(), depth.height(), Eigen::Vector3f::Zero());
  ParallelFor(0, depth.height(), [&](int y) {
    for (int x = 0; x < depth.width(); ++x)
      if (depth(x, y) > 0) normals(x, y) = FitPlane(problem, depth, x, y);
  });
  return normals;
}

Image<Eigen::Vector3f> SolveNormals(const Problem& problem, const Image<float>& depth,
                                    const Image<Eigen::Vector3f>& start, const NormalOptions& options) {
  const Image<Eigen::Vector3f> from_depth = DepthNormals(problem, depth);
  const NormalSolver solver(problem, depth, start, options);
  Image<Eigen::Vector3f> solved(depth.width(), depth.height(), Eigen::Vector3f::Zero());
  ParallelFor(0, depth.height(), [&](int y) {
    for (int x = 0; x < depth.width(); ++x)
      if (depth(x, y) > 0) solved(x, y) = solver.Solve(x, y, from_depth(x, y));
  });
  for (int i = 0; i < options.smoothings; ++i) {
    Image<Eigen::Vector3f> smooth(depth.width(), depth.height(), Eigen::Vector3f::Zero());
    ParallelFor(0, depth.height(), [&](int y) {
      for (int x = 0; x < depth.width(); ++x)
        if (depth(x, y) > 0) smooth(x, y) = Smoothed(solved, x, y);
    });
    solved = std::move(smooth);
  }
  return solved;
}

}  // namespace polarscan
