// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/outline_cut.h"

#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc/detail/gcgraph.hpp>

namespace polarscan {
namespace {

// Neighbours of a pixel, each pair once, and how much a cut between them counts: by the length of outline that it
// stands for.
struct GridNeighbour {
  int dx, dy;
  double weight;
};
constexpr std::array<GridNeighbour, 4> kNeighbours{{{1, 0, 1}, {0, 1, 1}, {1, 1, 0.7071}, {-1, 1, 0.7071}}};
constexpr double kLine =
    0.05;  // what it costs at the band's end that a pixel is cut off from its side of the line

class BandCut {
 public:
  BandCut(const LightSteps& light, const Image<float>& distance, double band_px)
      : light_(light), distance_(distance), band_px_(band_px), node_(light.width(), light.height(), -1) {}

  Image<std::uint8_t> Cut() {
    AddPixels();
    AddPairs();
    graph_.maxFlow();
    Image<std::uint8_t> mask(distance_.width(), distance_.height());
    for (std::size_t i = 0; i < mask.size(); ++i) {
      const int node = node_.pixels()[i];
      const bool inside = node >= 0 ? graph_.inSourceSegment(node) : distance_.pixels()[i] < 0;
      mask.pixels()[i] = inside ? 255 : 0;
    }
    return mask;
  }

 private:
  // Pixels of the band; those at its ends hold to their side.
  void AddPixels() {
    int count = 0;
    for (std::size_t i = 0; i < node_.size(); ++i)
      if (std::abs(double(distance_.pixels()[i])) < band_px_) node_.pixels()[i] = count++;
    graph_.create(unsigned(count), unsigned(count) * 2 * unsigned(kNeighbours.size()));
    for (std::size_t i = 0; i < node_.size(); ++i) {
      if (node_.pixels()[i] < 0) continue;
      graph_.addVtx();
      const double at = double(distance_.pixels()[i]) / band_px_;
      const double pull = std::abs(at) * band_px_ > band_px_ - 1 ? 1e3 : kLine * at * at;
      graph_.addTermWeights(node_.pixels()[i], at < 0 ? pull : 0, at < 0 ? 0 : pull);
    }
  }

  template <class Do>
  void ForPairs(Do&& act) const {
    for (int y = 0; y < node_.height(); ++y)
      for (int x = 0; x < node_.width(); ++x)
        for (const GridNeighbour& to : kNeighbours)
          if (node_(x, y) >= 0 && node_.Contains(x + to.dx, y + to.dy) && node_(x + to.dx, y + to.dy) >= 0)
            act(x, y, to);
  }

  void AddPairs() {
    double sum = 0;
    std::size_t count = 0;
    const auto square = [&](int x, int y, const GridNeighbour& to) {
      const double step = light_.Between(x, y, x + to.dx, y + to.dy);
      return step * step;
    };
    ForPairs([&](int x, int y, const GridNeighbour& to) { sum += square(x, y, to), ++count; });
    const double usual = std::max(1e-12, 2 * sum / double(std::max<std::size_t>(1, count)));
    ForPairs([&](int x, int y, const GridNeighbour& to) {
      const double weight = to.weight * std::exp(-square(x, y, to) / usual);
      graph_.addEdges(node_(x, y), node_(x + to.dx, y + to.dy), weight, weight);
    });
  }

  const LightSteps& light_;
  const Image<float>& distance_;
  double band_px_;
  Image<int> node_;  // in the graph; -1: outside of the band
  cv::detail::GCGraph<double> graph_;
};

}  // namespace

Image<std::uint8_t> CutAlongSteps(const LightSteps& light, const Image<float>& distance, double band_px) {
  return BandCut(light, distance, band_px).Cut();
}

}  // namespace polarscan
