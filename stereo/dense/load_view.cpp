// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/load_view.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/statistics.h"

namespace polarscan {
namespace {

// Of every seventh pixel.
float Percentile(const Image<float>& image, double share) {
  std::vector<double> values;
  for (std::size_t i = 0; i < image.size(); i += 7) values.push_back(double(image.pixels()[i]));
  return float(Quantile(std::move(values), share));
}

}  // namespace

float GrayScale(const Workspace& workspace) {
  const int count = int(workspace.views.size()), step = std::max(1, count / 16);
  float largest = 0;
  for (int view = 0; view < count; view += step)
    largest = std::max(largest, Percentile(ReadViewLight(workspace, view).s0, 0.995));
  return largest > 0 ? 1 / largest : 1;
}

bool AopIsInformative(const Workspace& workspace, bool masks, double aop_noise_deg) {
  constexpr float kSure = 0.5f;
  constexpr double kLeastShare = 0.01;
  if (!workspace.polarized) return false;
  StereoOptions options;
  options.aop_noise_deg = aop_noise_deg;
  std::size_t sure = 0, all = 0;
  const int count = int(workspace.views.size()), step = (count + 7) / 8;
  for (int view = 0; view < count; view += step) {
    const Image<PolarSample> samples = MakePolarSamples(ReadViewLight(workspace, view), options);
    const Image<std::uint8_t> mask = masks ? ReadViewMask(workspace, view) : Image<std::uint8_t>();
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (!mask.empty() && !mask.pixels()[i]) continue;
      ++all;
      sure += samples.pixels()[i].weight > kSure;
    }
  }
  return double(sure) >= kLeastShare * double(all);
}

StereoView LoadStereoView(const Workspace& workspace, int index, float gray_scale,
                          const StereoOptions& options, int halvings) {
  const DenseView& view = workspace.views[std::size_t(index)];
  return MakeStereoView(
      view.camera, view.cam_from_world, ReadViewLight(workspace, index), workspace.polarized,
      options.masks ? ReadViewMask(workspace, index) : Image<std::uint8_t>(), gray_scale, options, halvings);
}

}  // namespace polarscan
