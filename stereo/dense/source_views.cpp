// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/source_views.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace polarscan {
namespace {

constexpr double kBest = 20, kSpreadBelow = 12, kSpreadAbove = 18, kLargest = 80;  // degrees
constexpr double kSmallest = 3;    // degrees; below, depth is uncertain and the score falls to 0
constexpr int kSharedPoints = 15;  // with one other view
constexpr int kPartners = 6;       // other views with so many shared points
constexpr int kOverlapGrid = 7;    // samples a side of the picture for the overlap

double AngleAt(const Eigen::Vector3d& point, const DenseView& a, const DenseView& b) {
  return AngleDegrees(point - a.cam_from_world.Center(), point - b.cam_from_world.Center());
}

Eigen::Vector3d PointAt(const DenseView& view, double u, double v, double depth) {
  return view.cam_from_world.Inverse() * Eigen::Vector3d(view.camera.Ray(u, v) * depth);
}

bool Sees(const DenseView& view, const Eigen::Vector3d& point) {
  return view.camera.Sees(view.cam_from_world * point);
}

// Share of the reference's picture, as if all of it lay at `depth`, that the source sees.
double Overlap(const DenseView& reference, const DenseView& source, double depth) {
  int seen = 0;
  for (int y = 0; y < kOverlapGrid; ++y)
    for (int x = 0; x < kOverlapGrid; ++x) {
      const double u = (x + 0.5) * reference.camera.width / kOverlapGrid,
                   v = (y + 0.5) * reference.camera.height / kOverlapGrid;
      seen += Sees(source, PointAt(reference, u, v, depth));
    }
  return double(seen) / (kOverlapGrid * kOverlapGrid);
}

struct Pairs {
  std::vector<std::vector<double>> score;
  std::vector<std::vector<int>> shared;
};

Pairs ScorePairsByPoints(const std::vector<DenseView>& views, const std::vector<ScenePoint>& points) {
  const std::size_t n = views.size();
  Pairs pairs{std::vector(n, std::vector<double>(n)), std::vector(n, std::vector<int>(n))};
  for (const ScenePoint& point : points)
    for (const int a : point.views)
      for (const int b : point.views) {
        if (a >= b) continue;
        const std::size_t i = std::size_t(a), j = std::size_t(b);
        const double score = AngleScore(AngleAt(point.position, views[i], views[j]));
        pairs.score[i][j] += score;
        pairs.score[j][i] += score;
        ++pairs.shared[i][j];
        ++pairs.shared[j][i];
      }
  return pairs;
}

std::vector<double> ScoreByPoses(const std::vector<DenseView>& views, std::size_t reference, double depth) {
  const DenseView& view = views[reference];
  const Eigen::Vector3d place = PointAt(view, view.camera.width / 2.0, view.camera.height / 2.0, depth);
  std::vector<double> scores(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (i == reference) continue;
    const double angle_score = AngleScore(AngleAt(place, view, views[i]));
    if (angle_score > 0) scores[i] = angle_score * Overlap(view, views[i], depth);
    scores[i] =
        std::round(scores[i] * 1e9) / 1e9;  // equal by symmetry is equal, whatever the last digits say
  }
  return scores;
}

// own: the place of the view that they are for.
std::vector<int> BestOf(const std::vector<double>& scores, const std::vector<int>& places, int own,
                        int most) {
  std::vector<int> order, best;
  for (std::size_t i = 0; i < scores.size(); ++i)
    if (scores[i] > 0) order.push_back(int(i));
  std::ranges::stable_sort(order,
                           [&](int a, int b) { return scores[std::size_t(a)] > scores[std::size_t(b)]; });
  std::vector<bool> taken(scores.size());
  taken[std::size_t(own)] = true;
  for (const int view : order) {
    const auto place = std::size_t(places[std::size_t(view)]);
    if (taken[place] || best.size() >= std::size_t(most)) continue;
    taken[place] = true;
    best.push_back(view);
  }
  return best;
}

}  // namespace

double AngleScore(double angle_deg) {
  if (angle_deg <= 0 || angle_deg >= kLargest) return 0;
  const double away = (angle_deg - kBest) / (angle_deg < kBest ? kSpreadBelow : kSpreadAbove);
  return std::exp(-0.5 * away * away) * std::min(1.0, angle_deg / kSmallest);
}

std::vector<std::vector<int>> ChooseSourceViews(const std::vector<DenseView>& views,
                                                const std::vector<ScenePoint>& points, int most) {
  const Pairs pairs = ScorePairsByPoints(views, points);
  const std::vector<double> focus = FocusDepths(views, points);
  const std::vector<int> places = Places(views);
  const auto wanted = std::min<std::ptrdiff_t>(kPartners, std::ptrdiff_t(views.size()) - 1);
  std::vector<std::vector<int>> sources;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto partners =
        std::ranges::count_if(pairs.shared[i], [](int count) { return count >= kSharedPoints; });
    sources.push_back(BestOf(partners >= wanted ? pairs.score[i] : ScoreByPoses(views, i, focus[i]), places,
                             places[i], most));
  }
  return sources;
}

}  // namespace polarscan
