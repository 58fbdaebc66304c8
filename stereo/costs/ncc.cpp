// SPDX-License-Identifier: Apache-2.0
#include "stereo/costs/ncc.h"

#include <algorithm>
#include <cmath>

namespace polarscan {
namespace {
constexpr int kRangeSteps = 1024;
}

Window MakeWindow(int radius, int step, bool corners) {
  Window window;
  window.radius = radius;
  for (int dy = -radius; dy <= radius; dy += step)
    for (int dx = -radius; dx <= radius; dx += step) {
      if (!corners && dx * dx + dy * dy > 1.44 * radius * radius) continue;
      window.dx[window.taps] = float(dx);
      window.dy[window.taps] = float(dy);
      ++window.taps;
    }
  window.padded = (window.taps + 15) / 16 * 16;
  return window;
}

PatchReader::PatchReader(const Window& window, double sigma_color) : window_(window) {
  for (int i = 0; i < window.taps; ++i) {
    const double squared = double(window.dx[i]) * window.dx[i] + double(window.dy[i]) * window.dy[i];
    spatial_.push_back(float(std::exp(-squared / (2.0 * window.radius * window.radius))));
  }
  for (int i = 0; i <= kRangeSteps; ++i) {
    const double difference = double(i) / kRangeSteps;
    range_.push_back(float(std::exp(-difference * difference / (2 * sigma_color * sigma_color))));
  }
}

void PatchReader::Read(const Image<float>& gray, const Image<std::uint8_t>& mask, int x, int y,
                       Patch& patch) const {
  patch.center = gray(x, y);
  float sum = 0, sum_r = 0, sum_rr = 0;
  for (int i = 0; i < window_.taps; ++i) {
    const int px = x + int(window_.dx[i]), py = y + int(window_.dy[i]);
    float weight = 0, r = 0;
    if (gray.Contains(px, py) && (mask.empty() || mask(px, py))) {
      r = gray(px, py) - patch.center;
      const int step = std::min(kRangeSteps, int(std::abs(r) * kRangeSteps + 0.5f));
      weight = spatial_[std::size_t(i)] * range_[std::size_t(step)];
    }
    patch.weight[i] = weight;
    patch.weighted[i] = weight * r;
    sum += weight, sum_r += weight * r, sum_rr += weight * r * r;
  }
  const float scale = sum > 0 ? 1 / sum : 0;
  for (int i = 0; i < window_.taps; ++i) patch.weight[i] *= scale, patch.weighted[i] *= scale;
  for (int i = window_.taps; i < window_.padded; ++i) patch.weight[i] = patch.weighted[i] = 0;
  patch.mean = sum_r * scale;
  patch.variance = std::max(0.0f, sum_rr * scale - patch.mean * patch.mean);
}

PackedImage Pack(const Image<float>& gray) {
  PackedImage packed{gray.width(), gray.height(), std::vector<std::uint32_t>(gray.size())};
  const auto quantize = [](float v) { return std::uint32_t(std::clamp(v, 0.0f, 1.0f) * 65535.0f + 0.5f); };
  for (int y = 0; y < gray.height(); ++y)
    for (int x = 0; x < gray.width(); ++x)
      packed.words[std::size_t(y) * gray.width() + x] =
          quantize(gray(x, y)) | quantize(gray(std::min(x + 1, gray.width() - 1), y)) << 16;
  return packed;
}

float NccCostScalar(const Window& window, const Patch& patch, const Warp& h, const PackedImage& source,
                    const Contrast& contrast) {
  const float max_x = float(source.width) - 1.001f, max_y = float(source.height) - 1.001f;
  const float cu = h.u0 / h.w0, cv = h.v0 / h.w0;
  if (!(h.w0 > 0 && cu >= 0 && cv >= 0 && cu <= float(source.width) && cv <= float(source.height))) return 2;
  float sum_s = 0, sum_ss = 0, sum_rs = 0, nearest = h.w0;
  for (int i = 0; i < window.taps; ++i) {
    const float dx = window.dx[i], dy = window.dy[i];
    const float w = h.w0 + h.wx * dx + h.wy * dy;
    nearest = std::min(nearest, w);
    if (w <= 0) continue;
    const float u = std::clamp((h.u0 + h.ux * dx + h.uy * dy) / w - 0.5f, 0.0f, max_x);
    const float v = std::clamp((h.v0 + h.vx * dx + h.vy * dy) / w - 0.5f, 0.0f, max_y);
    const int iu = int(u), iv = int(v);
    const float fu = u - float(iu), fv = v - float(iv);
    const std::uint32_t* word = source.words.data() + std::size_t(iv) * source.width + iu;
    const std::uint32_t top = word[0], bottom = word[source.width];
    const float t = float(top & 0xFFFF) + fu * (float(top >> 16) - float(top & 0xFFFF));
    const float b = float(bottom & 0xFFFF) + fu * (float(bottom >> 16) - float(bottom & 0xFFFF));
    const float s = (t + fv * (b - t)) * (1 / 65535.0f) - patch.center;
    sum_s += patch.weight[i] * s;
    sum_ss += patch.weight[i] * s * s;
    sum_rs += patch.weighted[i] * s;
  }
  if (nearest <= 0) return 2;
  const float covariance = sum_rs - patch.mean * sum_s;
  const float variance = std::max(0.0f, sum_ss - sum_s * sum_s);
  return NccCostOf(patch.variance, variance, covariance, contrast);
}

}  // namespace polarscan
