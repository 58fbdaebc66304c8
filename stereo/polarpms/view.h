// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <list>
#include <map>
#include <memory>

#include "core/camera.h"
#include "core/image.h"
#include "stereo/polarpms/ncc.h"
#include "stereo/polarpms/options.h"
#include "stereo/workspace.h"

namespace polarscan {

// The AoP phi of one pixel as its cosine and sine, how much it counts (g of eq. (8), or the noise-aware
// weight), and the DoP. 16 bytes.
struct PolarSample {
  float cos_phi = 1, sin_phi = 0, weight = 0, dop = 0;
};

// One view as the matcher needs it. Grey is S0 in [0, 1] after gamma 1/2.2, one scale for the whole set.
struct StereoView {
  Pinhole camera;
  Rigid cam_from_world;
  Image<float> gray;
  PackedImage packed;
  Image<PolarSample> polar;        // empty if the set is not polarized
  Image<float> evidence;           // 0 to 1: how far the pixel's surroundings say anything, by texture or AoP
  Image<std::uint8_t> mask;        // 255 = object; empty: everything
  Image<std::uint8_t> silhouette;  // the mask widened by the margin; empty: no mask
  bool whole_silhouette =
      false;  // it keeps clear of the border: nothing of the object lies outside of the picture
};

// Depth (z, 0 = none) and unit normal (camera frame, facing the camera) of every pixel.
struct DepthNormalMap {
  Image<float> depth;
  Image<Eigen::Vector3f> normal;
};

// The grey value's scale: the largest 99.5th percentile of S0 among at most 16 views.
float GrayScale(const Workspace& workspace);

// S0 as grey values, 0 to 1, with a gamma of 2.2; and a view's polarization. Sizes as the picture's.
Image<float> MakeGray(const Image<float>& s0, float scale);
Image<PolarSample> MakePolarSamples(const StokesImage& stokes, const StereoOptions& options);

// Whether the set's AoP say anything: of the pixels of at most eight views, inside the masks where they
// count, one in a hundred is surer than half. Of noise none is: with the usual aop_noise_deg its weight would
// need a DoP of seven times the noise.
bool AopTells(const Workspace& workspace, bool masks, double aop_noise_deg = StereoOptions().aop_noise_deg);

// The view, its size halved so often: means of 2x2 pixels (an odd last row or column is left out); a pixel is
// invalid if one of the four is, and in the mask if one of the four is.
StereoView LoadStereoView(const Workspace& workspace, int view, float gray_scale,
                          const StereoOptions& options, int halvings = 0);
Pinhole HalfCamera(const Pinhole& camera);

// Whether no pixel of the picture's border is set.
bool KeepsClearOfBorder(const Image<std::uint8_t>& mask);

// Each pixel of `mask` that has a set pixel within `radius` (rounded box) becomes set.
Image<std::uint8_t> Dilate(const Image<std::uint8_t>& mask, double radius);

// Keeps recently used values under a limit of bytes. Not for several threads at once.
template <class Value>
class Cache {
 public:
  Cache(std::size_t limit_bytes, std::function<Value(int)> load,
        std::function<std::size_t(const Value&)> size)
      : limit_(limit_bytes), load_(std::move(load)), size_(std::move(size)) {}

  std::shared_ptr<const Value> Get(int key) {
    if (auto found = entries_.find(key); found != entries_.end()) {
      order_.splice(order_.begin(), order_, found->second.place);
      return found->second.value;
    }
    auto value = std::make_shared<const Value>(load_(key));
    const std::size_t bytes = size_(*value);
    while (!order_.empty() && used_ + bytes > limit_) DropOldest();
    order_.push_front(key);
    entries_[key] = {value, bytes, order_.begin()};
    used_ += bytes;
    return value;
  }

 private:
  struct Entry {
    std::shared_ptr<const Value> value;
    std::size_t bytes;
    std::list<int>::iterator place;
  };
  void DropOldest() {
    used_ -= entries_.at(order_.back()).bytes;
    entries_.erase(order_.back());
    order_.pop_back();
  }
  std::size_t limit_, used_ = 0;
  std::function<Value(int)> load_;
  std::function<std::size_t(const Value&)> size_;
  std::map<int, Entry> entries_;
  std::list<int> order_;
};

}  // namespace polarscan
