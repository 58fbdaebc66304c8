// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <new>
#include <optional>
#include <span>
#include <vector>

namespace polarscan {

// Memory that begins at a cache line, so that vector loops over several pictures find them aligned alike.
template <class T>
struct AlignedAllocator {
  using value_type = T;
  static constexpr std::align_val_t kLine{64};
  AlignedAllocator() = default;
  template <class U>
  AlignedAllocator(const AlignedAllocator<U>&) {}
  T* allocate(std::size_t count) { return static_cast<T*>(::operator new(count * sizeof(T), kLine)); }
  void deallocate(T* values, std::size_t) { ::operator delete(values, kLine); }
  bool operator==(const AlignedAllocator&) const = default;
};

// A picture of width x height values, rows top to bottom, no padding. Axes: x right, y down; the centre of
// pixel (x, y) lies at continuous coordinates (x + 0.5, y + 0.5) (docs/conventions.md).
template <class T>
class Image {
 public:
  Image() = default;
  Image(int width, int height, T value = T())
      : width_(width), height_(height), data_(std::size_t(width) * std::size_t(height), value) {}

  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t size() const { return data_.size(); }
  bool empty() const { return data_.empty(); }
  bool Contains(int x, int y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }

  T& operator()(int x, int y) { return data_[std::size_t(y) * width_ + x]; }
  const T& operator()(int x, int y) const { return data_[std::size_t(y) * width_ + x]; }
  T* row(int y) { return data_.data() + std::size_t(y) * width_; }
  const T* row(int y) const { return data_.data() + std::size_t(y) * width_; }
  std::span<T> pixels() { return data_; }
  std::span<const T> pixels() const { return data_; }

 private:
  int width_ = 0, height_ = 0;
  std::vector<T, AlignedAllocator<T>> data_;
};

// The value at image point (u, v), from the four pixels whose centres lie around it; none where one is
// missing.
template <class T>
std::optional<float> Bilinear(const Image<T>& image, double u, double v) {
  const int left = int(std::floor(u - 0.5)), top = int(std::floor(v - 0.5));
  if (!image.Contains(left, top) || !image.Contains(left + 1, top + 1)) return {};
  const auto right = float(u - 0.5 - left), low = float(v - 0.5 - top);
  const T *above = image.row(top) + left, *below = image.row(top + 1) + left;
  return (1 - low) * ((1 - right) * float(above[0]) + right * float(above[1])) +
         low * ((1 - right) * float(below[0]) + right * float(below[1]));
}

// The width x height pixels from (left, top) on, one at least, all of them in the image.
template <class T>
Image<T> Cropped(const Image<T>& image, int left, int top, int width, int height) {
  Image<T> part(width, height, image(left, top));
  for (int y = 0; y < height; ++y) std::copy_n(image.row(top + y) + left, width, part.row(y));
  return part;
}

struct Rgb8 {
  std::uint8_t r = 0, g = 0, b = 0;
  bool operator==(const Rgb8&) const = default;
};

template <class A, class B>
bool SameSize(const Image<A>& a, const Image<B>& b) {
  return a.width() == b.width() && a.height() == b.height();
}

}  // namespace polarscan
