// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/refinement/photometric.h"

#include <Eigen/Core>
#include <cmath>

#include "core/parallel.h"

namespace polarscan {
namespace {

constexpr int kSteps = 8;           // distances along the normal, a mean edge apart
constexpr int kRings = 4;           // of vertices in a view's window: times that neighbours are averaged
constexpr int kPairRings = 3;       // the same for the pairs' products
constexpr float kContrast = 0.02f;  // standard deviation over mean that counts half
constexpr float kLeastAgreement = 0.1f;

// A value at each distance.
using Steps = Eigen::Array<float, kSteps, 1>;

// Samples and their squares, or sums of values and of their squares.
using Lanes = Eigen::Array<float, 2 * kSteps, 1>;

double EdgesAlong(int step) { return step - (kSteps - 1) / 2.0; }

// Means over each vertex and its neighbours, so many times, where `vertices` says; others stay.
template <class T>
void Spread(std::vector<T>& values, std::vector<T>& scratch, const std::vector<std::uint32_t>& vertices,
            const VertexNeighbours& neighbours, int rings) {
  for (int ring = 0; ring < rings; ++ring) {
    ParallelFor(0, int(vertices.size()), [&](int i) {
      const std::uint32_t vertex = vertices[std::size_t(i)];
      T sum = values[vertex];
      const auto around = neighbours.Of(vertex);
      for (std::uint32_t other : around) sum += values[other];
      scratch[vertex] = sum / float(around.size() + 1);
    });
    values.swap(scratch);
  }
}

// Sums over views, at each vertex.
class PhotometricSums {
 public:
  PhotometricSums(const TriangleMesh& mesh, const VertexNeighbours& neighbours, double edge)
      : mesh_(mesh),
        edge_(edge),
        neighbours_(neighbours),
        products_(mesh.vertices.size(), Lanes::Zero()),
        pairs_(mesh.vertices.size(), 0),
        squares_(mesh.vertices.size(), 0),
        own_(products_),
        means_(products_),
        scratch_(products_),
        seen_(pairs_),
        seen_scratch_(pairs_) {}

  void Add(const DenseView& view, const Image<std::uint16_t>& gray, const std::vector<bool>& visible) {
    const Eigen::Vector3d centre = view.cam_from_world.Center();
    const std::vector<std::uint32_t> vertices = Look(view, gray, visible);
    Spread(means_, scratch_, vertices, neighbours_, kRings);
    Spread(seen_, seen_scratch_, vertices, neighbours_, kRings);
    ParallelFor(0, int(vertices.size()), [&](int i) {
      const std::uint32_t v = vertices[std::size_t(i)];
      const double cosine = mesh_.normals[v].dot((centre - mesh_.vertices[v]).normalized());
      const auto weight = float(cosine * cosine);
      const Steps mean = means_[v].head<kSteps>() / seen_[v];
      const Steps variance = (means_[v].tail<kSteps>() / seen_[v] - mean.square()).max(0);
      const Steps value =
          weight * (own_[v].head<kSteps>() - mean) / (variance + (kContrast * mean).square() + 1e-6f).sqrt();
      products_[v].head<kSteps>() += value, products_[v].tail<kSteps>() += value.square();
      pairs_[v] += weight, squares_[v] += weight * weight;
    });
    for (std::vector<Lanes>* lanes : {&own_, &means_, &scratch_})
      for (std::uint32_t v : vertices) (*lanes)[v].setZero();
    for (std::uint32_t v : vertices) seen_[v] = seen_scratch_[v] = 0;
  }

  // Of the sums: (sum^2 - sum of squares) is the sum over all pairs.
  std::vector<Pull> Pulls() {
    std::vector<std::uint32_t> all(mesh_.vertices.size());
    for (std::uint32_t v = 0; v < all.size(); ++v) {
      all[v] = v;
      products_[v].head<kSteps>() = products_[v].head<kSteps>().square() - products_[v].tail<kSteps>();
      pairs_[v] = pairs_[v] * pairs_[v] - squares_[v];
    }
    Spread(products_, scratch_, all, neighbours_, kPairRings);
    Spread(pairs_, seen_scratch_, all, neighbours_, kPairRings);
    std::vector<Pull> pulls;
    for (std::uint32_t v : all) pulls.push_back(pairs_[v] > 1e-3f ? Best(products_[v], pairs_[v]) : Pull());
    return pulls;
  }

 private:
  // Takes the samples; which vertices have some.
  std::vector<std::uint32_t> Look(const DenseView& view, const Image<std::uint16_t>& gray,
                                  const std::vector<bool>& visible) {
    ParallelFor(0, int(visible.size()), [&](int i) {
      const auto v = std::size_t(i);
      if (!visible[v]) return;
      const Eigen::Vector3d begin = view.cam_from_world * mesh_.vertices[v];
      const Eigen::Vector3d along = edge_ * (view.cam_from_world.rotation * mesh_.normals[v]);
      Lanes lanes;
      for (int k = 0; k < kSteps; ++k) {
        const Eigen::Vector3d p = begin + EdgesAlong(k) * along;
        if (p.z() <= 0) return;
        const Eigen::Vector2d at = view.camera.Project(p);
        const std::optional<float> value = Bilinear(gray, at.x(), at.y());
        if (!value) return;
        lanes[k] = *value, lanes[k + kSteps] = *value * *value;
      }
      own_[v] = means_[v] = lanes;
      seen_[v] = 1;
    });
    std::vector<std::uint32_t> vertices;
    for (std::uint32_t v = 0; v < seen_.size(); ++v)
      if (seen_[v] > 0) vertices.push_back(v);
    return vertices;
  }

  Pull Best(const Lanes& products, float pairs) const {
    int best = 0;
    const float most = products.head<kSteps>().maxCoeff(&best);
    if (best == 0 || best == kSteps - 1 || most < kLeastAgreement * pairs) return {};
    const double before = products[best - 1], here = most, after = products[best + 1];
    const double bend = before - 2 * here + after;
    if (!(bend < 0)) return {};
    const double place = EdgesAlong(best) + (before - after) / (2 * bend);
    return {place * edge_, -bend / pairs};
  }

  const TriangleMesh& mesh_;
  double edge_;
  const VertexNeighbours& neighbours_;
  std::vector<Lanes> products_;
  std::vector<float> pairs_, squares_;        // sums of weights, and of their squares
  std::vector<Lanes> own_, means_, scratch_;  // of one view
  std::vector<float> seen_, seen_scratch_;
};

}  // namespace

std::vector<Pull> PhotometricPulls(const TriangleMesh& mesh, const VertexNeighbours& neighbours,
                                   const std::vector<DenseView>& views, const SurfaceAppearance& appearance,
                                   Progress& progress) {
  PhotometricSums comparison(mesh, neighbours, MeanEdge(mesh));
  for (std::size_t view = 0; view < appearance.grays.size(); ++view) {
    progress.Check();
    comparison.Add(views[view], appearance.grays[view], appearance.visible[view]);
  }
  return comparison.Pulls();
}

}  // namespace polarscan
