// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/statistics.h"

namespace polarscan {

// How much values scatter, by the brightness they go with: learnt from samples of which the smaller ones are noise, the
// larger ones perhaps something that moved. Noise grows with the light, at most as the light does: a brightness with
// few samples, or with none but large ones, is held to that.
class NoiseByBrightness {
 public:
  // bright: the light that counts as 1; below `least` of it no scatter is believed.
  explicit NoiseByBrightness(float bright, float least = 2e-3f) : bright_(bright), least_(least) {
    scatter_.fill(least * bright);
  }

  // size: what a value is off by, without sign.
  void Add(float light, double size) { samples_[Place(light)].push_back(size); }

  // share: of the sizes of each brightness, which are noise; factor: times the largest of them.
  void Learn(double share, double factor) {
    std::size_t all = 0;
    for (const auto& of_place : samples_) all += of_place.size();
    scatter_.fill(std::numeric_limits<float>::max());
    for (std::size_t from = 0; from < kPlaces; ++from) {
      if (double(samples_[from].size()) < kEnough * double(all)) continue;
      const auto seen = float(factor * Quantile(std::move(samples_[from]), share));
      for (std::size_t k = 0; k < kPlaces; ++k) {
        const float root = (float(k) + 0.5f) / (float(from) + 0.5f);
        scatter_[k] = std::min(scatter_[k], seen * std::max(1.f, root * root));
      }
    }
    for (float& scatter : scatter_) scatter = std::max(scatter, least_ * bright_);
    samples_ = {};
  }

  float At(float light) const { return scatter_[Place(light)]; }

 private:
  static constexpr std::size_t kPlaces = 12;
  static constexpr double kEnough = 0.01;  // of all samples

  std::size_t Place(float light) const {
    const float root = std::sqrt(std::max(0.f, light / bright_));
    return std::min(std::size_t(root * float(kPlaces)), kPlaces - 1);
  }

  float bright_, least_;
  std::array<std::vector<double>, kPlaces> samples_;
  std::array<float, kPlaces> scatter_;
};

}  // namespace polarscan
