// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/refinement/pose_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "core/parallel.h"
#include "core/statistics.h"
#include "fusion/surface/refinement/mesh_views.h"
#include "fusion/surface/refinement/silhouettes.h"
#include "stereo/costs/stereo_view.h"

namespace polarscan {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr std::array<double, 3> kOutlineReach{0.16, 0.04,
                                              0.015};  // of the object's size, one after the other
constexpr double kLeastOutlineReach = 6;               // px
constexpr double kShown = 0.1;    // of the object's size: farther off, outlines miss each other
constexpr int kStepsAtReach = 4;  // at each reach
constexpr int kLastSteps = 12;
constexpr double kStepPx = 5;                   // what a step moves the picture by, if nothing says otherwise
constexpr double kStill = 0.02;                 // px: a step that ends them
constexpr double kFineBlur = 1, kWideBlur = 4;  // px: what appearance is, and less what
constexpr float kDarkest = 0.02f;               // grey: below, it is no share of the surroundings
constexpr double kLeastScale = 0.3;             // px: what outlines differ by at best
constexpr double kOutlineWeight = 1.0 / 3,
                 kLookWeight = 1.0 / 30;                   // of a vertex: its neighbours say the same
constexpr int kLookViews = 4;                              // that must see a vertex
constexpr std::size_t kFewOutlines = 60, kFewLooks = 300;  // vertices
constexpr double kToldSigma = 0.5;                         // px: a worse known pose stays

// What is asked of a pose: a linear system of its change (w, u), camera frame: p becomes p + w x p + u.
struct PoseSystem {
  Matrix6 squares = Matrix6::Zero();
  Vector6 right = Vector6::Zero();

  // slope: of an image value by image place, times that of the place by the point, is `by_point`.
  void Add(const Eigen::Vector3d& p, const Eigen::Vector3d& by_point, double residual, double weight) {
    Vector6 row;
    row << p.cross(by_point), by_point;
    squares += weight * row * row.transpose();
    right -= weight * residual * row;
  }
};

// Of an image place by its camera-frame point, contracted with a slope.
Eigen::Vector3d ByPoint(const Pinhole& camera, const Eigen::Vector3d& p, const Eigen::Vector2d& slope) {
  const double x = slope.x() * camera.fx / p.z(), y = slope.y() * camera.fy / p.z();
  return {x, y, -(x * p.x() + y * p.y()) / p.z()};
}

Rigid Changed(const Rigid& pose, const Vector6& change) {
  const Eigen::Vector3d w = change.head<3>();
  const double angle = w.norm();
  const Eigen::Matrix3d turn =
      angle > 0 ? Eigen::AngleAxisd(angle, w / angle).toRotationMatrix() : Eigen::Matrix3d::Identity();
  return Rigid{turn, change.tail<3>()} * pose;
}

// Eigen's FromTwoVectors for rays of a camera, which are never opposite: for those it brings a decomposition.
Eigen::Quaterniond TurnBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d a = from.normalized(), b = to.normalized();
  const double twice = std::sqrt((1 + b.dot(a)) * 2);  // the cosine of half the angle
  Eigen::Quaterniond turn;
  turn.vec() = a.cross(b) * (1 / twice);
  turn.w() = twice * 0.5;
  return turn;
}

cv::Mat AsCv(Image<float>& image) { return cv::Mat(image.height(), image.width(), CV_32F, image.row(0)); }

// Grey values less the surroundings', as a share of these.
Image<float> Look(const StokesImage& light) {
  Image<float> gray = MakeGray(light.s0, 1), look(gray.width(), gray.height());
  cv::Mat fine, wide;
  cv::GaussianBlur(AsCv(gray), fine, {}, kFineBlur);
  cv::GaussianBlur(AsCv(gray), wide, {}, kWideBlur);
  for (int y = 0; y < look.height(); ++y)
    for (int x = 0; x < look.width(); ++x) {
      const float around = wide.at<float>(y, x);
      look(x, y) = (fine.at<float>(y, x) - around) / (around + kDarkest);
    }
  return look;
}

// How the vertices look in the mean of the views that see them; none: seen by few.
std::vector<std::optional<float>> MeanLooks(const TriangleMesh& mesh, const SurfaceViews& views,
                                            const std::vector<std::vector<bool>>& visible,
                                            Progress& progress) {
  std::vector<float> sums(mesh.vertices.size());
  std::vector<int> counts(mesh.vertices.size());
  for (std::size_t v = 0; v < views.views.size(); ++v) {
    progress.Check();
    const Image<float> look = Look(views.light(int(v)));
    const DenseView& view = views.views[v];
    ParallelFor(0, int(sums.size()), [&](int i) {
      const auto k = std::size_t(i);
      if (!visible[v][k]) return;
      const Eigen::Vector2d at = view.camera.Project(view.cam_from_world * mesh.vertices[k]);
      if (const auto value = Bilinear(look, at.x(), at.y())) sums[k] += *value, ++counts[k];
    });
    progress.Advance();
  }
  std::vector<std::optional<float>> means(sums.size());
  for (std::size_t k = 0; k < sums.size(); ++k)
    if (counts[k] >= kLookViews) means[k] = sums[k] / float(counts[k]);
  return means;
}

double Robust(double residual, double scale) {
  const double r = residual / scale;
  return 1 / (1 + r * r) / (scale * scale);
}

double ScaleOfResiduals(const std::vector<double>& residuals, double least) {
  std::vector<double> sizes;
  for (const double r : residuals) sizes.push_back(std::abs(r));
  return std::max(least, 1.48 * Median(std::move(sizes)));
}

// Fits one view.
class ViewFit {
 public:
  ViewFit(const TriangleMesh& mesh, const RayCaster& caster, const std::vector<std::optional<float>>& looks,
          const std::vector<bool>& visible, DenseView view, Image<std::uint8_t> mask, Image<float> look)
      : mesh_(mesh),
        caster_(caster),
        looks_(looks),
        visible_(visible),
        given_(view.cam_from_world),
        view_(std::move(view)),
        mask_(std::move(mask)),
        look_(std::move(look)) {}

  PoseFit Fit() {
    const double size =
        std::sqrt(double(std::ranges::count_if(mask_.pixels(), [](auto p) { return p != 0; })));
    if (!mask_.empty()) ShiftToMask(size);
    Matrix6 squares = Matrix6::Zero();
    for (const double reach : kOutlineReach) {
      const bool last = reach == kOutlineReach.back();
      if (mask_.empty() && !last) continue;
      for (int step = 0; step < (last ? kLastSteps : kStepsAtReach); ++step) {
        PoseSystem system;
        if (!mask_.empty()) AddOutlines(std::max(kLeastOutlineReach, reach * size), system);
        if (last) AddLooks(system);
        squares = system.squares;
        const Rigid before = view_.cam_from_world;
        view_.cam_from_world = Changed(before, (squares + Prior()).ldlt().solve(system.right));
        if (!(Moved(before) > kStill)) break;
      }
    }
    if (!IsTold(squares) || !view_.cam_from_world.translation.allFinite()) return {given_, 0, false};
    return {view_.cam_from_world, Moved(given_), true};
  }

 private:
  // Turns the camera so that the surface shows where the mask is, if it shows elsewhere by more than outlines that look
  // for each other would find.
  void ShiftToMask(double size) {
    constexpr double kCells = 40;  // of the size
    Image<std::uint8_t> shown(std::max(1, int(mask_.width() * kCells / size)),
                              std::max(1, int(mask_.height() * kCells / size)));
    Eigen::Vector2d drawn(0, 0), surface(0, 0);
    double drawn_count = 0, surface_count = 0;
    for (int y = 0; y < mask_.height(); ++y)
      for (int x = 0; x < mask_.width(); ++x)
        if (mask_(x, y)) drawn += Eigen::Vector2d(x + 0.5, y + 0.5), ++drawn_count;
    for (const Eigen::Vector3d& vertex : mesh_.vertices) {
      const Eigen::Vector3d p = view_.cam_from_world * vertex;
      if (!view_.camera.Sees(p)) return;  // the picture does not show all of it
      const Eigen::Vector2d at = view_.camera.Project(p);
      std::uint8_t& cell = shown(std::min(shown.width() - 1, int(at.x() * shown.width() / mask_.width())),
                                 std::min(shown.height() - 1, int(at.y() * shown.height() / mask_.height())));
      if (!cell) surface += at, ++surface_count;
      cell = 1;
    }
    if (drawn_count == 0 || surface_count == 0 || !KeepsClearOfBorder(mask_)) return;
    const Eigen::Vector2d from = surface / surface_count, to = drawn / drawn_count;
    if ((to - from).norm() < kShown * size) return;
    const Eigen::Quaterniond turn =
        TurnBetween(view_.camera.Ray(from.x(), from.y()), view_.camera.Ray(to.x(), to.y()));
    view_.cam_from_world = Rigid{turn.toRotationMatrix(), Eigen::Vector3d::Zero()} * view_.cam_from_world;
  }

  void AddOutlines(double reach_px, PoseSystem& system) const {
    const std::vector<OutlinePull> pulls = OutlinePulls(mesh_, caster_, view_, mask_, reach_px);
    if (pulls.size() < kFewOutlines) return;
    std::vector<double> distances;
    for (const OutlinePull& pull : pulls) distances.push_back(pull.distance_px);
    const double scale = ScaleOfResiduals(distances, kLeastScale);
    for (const OutlinePull& pull : pulls) {
      const Eigen::Vector3d p = view_.cam_from_world * mesh_.vertices[pull.vertex];
      system.Add(p, ByPoint(view_.camera, p, pull.out), -pull.distance_px,
                 kOutlineWeight * Robust(pull.distance_px, scale));
    }
  }

  void AddLooks(PoseSystem& system) const {
    struct Seen {
      Eigen::Vector3d p;
      Eigen::Vector2d slope;
    };
    std::vector<Seen> seen;
    std::vector<double> residuals;
    for (std::size_t k = 0; k < looks_.size(); ++k) {
      if (!visible_[k] || !looks_[k]) continue;
      const Eigen::Vector3d p = view_.cam_from_world * mesh_.vertices[k];
      if (p.z() <= 0) continue;
      const Eigen::Vector2d at = view_.camera.Project(p);
      const auto here = Bilinear(look_, at.x(), at.y()), left = Bilinear(look_, at.x() - 1, at.y()),
                 right = Bilinear(look_, at.x() + 1, at.y()), up = Bilinear(look_, at.x(), at.y() - 1),
                 down = Bilinear(look_, at.x(), at.y() + 1);
      if (!here || !left || !right || !up || !down) continue;
      seen.push_back({p, {(*right - *left) / 2.0, (*down - *up) / 2.0}});
      residuals.push_back(double(*here) - double(*looks_[k]));
    }
    if (seen.size() < kFewLooks) return;
    const double scale = ScaleOfResiduals(residuals, 1e-4);
    for (std::size_t i = 0; i < seen.size(); ++i)
      system.Add(seen[i].p, ByPoint(view_.camera, seen[i].p, seen[i].slope), residuals[i],
                 kLookWeight * Robust(residuals[i], scale));
  }

  // Root mean square over the visible vertices.
  double Moved(const Rigid& before) const {
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t k = 0; k < visible_.size(); ++k) {
      if (!visible_[k]) continue;
      sum += (view_.camera.Project(view_.cam_from_world * mesh_.vertices[k]) -
              view_.camera.Project(before * mesh_.vertices[k]))
                 .squaredNorm();
      ++count;
    }
    return std::sqrt(sum / double(std::max<std::size_t>(1, count)));
  }

  // Of steps of kStepPx by the camera's turn, and as much by its move: what nothing else tells stays. (Not of what the
  // surface moves by in the picture: that would rather roll a round object than shift it.)
  Matrix6 Prior() const {
    const double depth = std::max(1e-12, (view_.depth_min + view_.depth_max) / 2);
    const double px = view_.camera.fx / kStepPx;
    Vector6 squares;
    squares << Eigen::Vector3d::Constant(px * px), Eigen::Vector3d::Constant(px * px / (depth * depth));
    return squares.asDiagonal();
  }

  // Whether the system says where the surface shows, to kToldSigma; asked are some of the visible vertices.
  bool IsTold(const Matrix6& squares) const {
    constexpr std::size_t kEvery = 16;
    const Eigen::LDLT<Matrix6> solver(squares);
    if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 0)) return false;
    double sum = 0, count = 0;
    for (std::size_t k = 0; k < visible_.size(); k += kEvery) {
      if (!visible_[k]) continue;
      const Eigen::Vector3d p = view_.cam_from_world * mesh_.vertices[k];
      for (const Eigen::Vector2d& axis : {Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1)}) {
        PoseSystem row;
        row.Add(p, ByPoint(view_.camera, p, axis), -1, 1);
        sum += row.right.dot(solver.solve(row.right));
      }
      ++count;
    }
    return count > 0 && std::sqrt(sum / count) < kToldSigma;
  }

  const TriangleMesh& mesh_;
  const RayCaster& caster_;
  const std::vector<std::optional<float>>& looks_;
  const std::vector<bool>& visible_;
  const Rigid given_;
  DenseView view_;
  const Image<std::uint8_t> mask_;
  const Image<float> look_;
};

}  // namespace

std::vector<PoseFit> FitPoses(const TriangleMesh& mesh, const SurfaceViews& views, bool masks,
                              Progress& progress) {
  const std::size_t count = views.views.size();
  const std::vector<std::vector<bool>> visible = VisibleVertices(mesh, views.views, progress);
  progress.Begin("fit of the poses", 2 * count);
  const std::vector<std::optional<float>> looks = MeanLooks(mesh, views, visible, progress);
  const RayCaster caster({mesh});
  std::vector<PoseFit> fits(count);
  ParallelFor(0, int(count), [&](int i) {
    progress.Check();
    const auto v = std::size_t(i);
    fits[v] = ViewFit(mesh, caster, looks, visible[v], views.views[v],
                      masks ? views.mask(i) : Image<std::uint8_t>(), Look(views.light(i)))
                  .Fit();
    progress.Advance();
  });
  return fits;
}

}  // namespace polarscan
