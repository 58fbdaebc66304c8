// SPDX-License-Identifier: Apache-2.0
#include "demosaic/fused/fused.h"

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>

#include <algorithm>

#include "core/error.h"
#include "core/parallel.h"
#include "demosaic/fused/fused_rows.h"
#include "demosaic/methods/linear.h"
#include "demosaic/methods/reflect.h"

namespace polarscan {
namespace {

using namespace fused;

constexpr int kBandRows = 32;  // keeps a band's intermediates in the second-level cache

// Share of each mean of bilinear.h (own, row, column, across) in S1 and S2 in a row of this parity.
StokesShares SharesOfRow(const Layout& layout, int y) {
  StokesShares shares{};
  for (int place = 0; place < 4; ++place)
    for (int x = 0; x < 2; ++x) {
      const int angle = layout.AngleAt(x ^ (place & 1), y ^ (place >> 1));
      shares.s1[place][x] = angle == 0 ? 1.f : angle == 90 ? -1.f : 0.f;
      shares.s2[place][x] = angle == 45 ? 1.f : angle == 135 ? -1.f : 0.f;
    }
  return shares;
}

LinearRowKernels KernelsOfRow(const LinearKernels::Set& set, const std::array<Carrier, 2>& carriers, int y) {
  LinearRowKernels row{set.s0, set.first, set.second, {}, {}};
  for (int k = 0; k < 2; ++k)
    for (int x = 0; x < 2; ++x) {
      const Carrier& carrier = carriers[std::size_t(k)];
      row.s1[k][x] = 4 * carrier.q1 * carrier.SignAt(x, y);
      row.s2[k][x] = 4 * carrier.q2 * carrier.SignAt(x, y);
    }
  return row;
}

}  // namespace

class FusedDemosaic::Implementation {
 public:
  Implementation(const std::string& method, const Sensor& sensor, const PixelFormat& format, int width,
                 int height)
      : method_(method == "preview" ? "bilinear" : method), format_(format), width_(width), height_(height) {
    if (method_ != "bilinear" && method_ != "difference" && method_ != "linear")
      throw Error("this method has no fast path", method, "Known: preview, bilinear, difference, linear");
    if (!sensor.layout.bayer.empty() || !format.bayer.empty() || sensor.gamma != 1)
      throw Error("the fast path is for mono sensors with gamma 1", ToString(sensor.layout));
    if (width < 4 || height < 4)
      throw Error("a mosaic needs at least 4x4 pixels", fmt::format("{}x{}", width, height));
    light_ = {float(sensor.black_dn), float(1 / sensor.RangeDn())};
    const std::array<Carrier, 2> carriers = Carriers(sensor.layout);
    for (int y = 0; y < 2; ++y) {
      shares_[y] = SharesOfRow(sensor.layout, y);
      kernels_[y] = KernelsOfRow(KernelsFor(carriers, FittedKernels()), carriers, y);
    }
    reach_ = method_ == "bilinear" ? 1 : method_ == "linear" ? 3 : 5;
    stride_ = std::size_t((width + 2 * kBorder + kSlack + 15) / 16 * 16);
    band_size_ = stride_ * std::size_t(kBandRows + 2 * reach_);
  }

  void Run(std::span<const std::uint8_t> bytes, PolarPlanes& planes, bool angles, std::size_t stride) {
    if (bytes.size() < PayloadBytes(format_, width_, height_, stride))
      throw Error(fmt::format("a {}x{} frame does not fit in its {} bytes", width_, height_, bytes.size()),
                  format_.name);
    for (Image<float>* plane : {&planes.s0, &planes.s1, &planes.s2}) Resize(*plane);
    if (angles) Resize(planes.dop), Resize(planes.aop);
    const int bands = (height_ + kBandRows - 1) / kBandRows;
    ParallelFor(0, bands, [&](int band) {
      Floats& scratch = scratch_.local();
      scratch.resize(band_size_ * (method_ == "difference" ? 9 : 1));
      RunBand(bytes, stride, band * kBandRows, std::min(height_, (band + 1) * kBandRows), scratch, planes,
              angles);
    });
  }

 private:
  using Floats = std::vector<float, AlignedAllocator<float>>;  // rows that begin at cache lines

  void Resize(Image<float>& plane) const {
    if (plane.width() != width_ || plane.height() != height_) plane = Image<float>(width_, height_);
  }

  // Rows begin at whole bytes or are unpacked one by one.
  void ReadRow(std::span<const std::uint8_t> bytes, std::size_t stride, int y, float* out) const {
    const std::size_t bits = format_.packing == Packing::kWords ? 16 : std::size_t(format_.bits);
    const std::size_t first_bit =
        stride ? 8 * stride * std::size_t(y) : bits * std::size_t(y) * std::size_t(width_);
    if (first_bit % 8 == 0 && format_.packing != Packing::kMipi) {
      UnpackRow(format_.packing, format_.bits, bytes.data() + first_bit / 8, bytes.data() + bytes.size(),
                width_, light_, out);
    } else {
      const std::vector<std::uint16_t> row =
          UnpackSamples(format_, bytes.subspan(stride * std::size_t(y)),
                        stride ? 0 : std::size_t(y) * std::size_t(width_), std::size_t(width_));
      for (int x = 0; x < width_; ++x) out[x] = (float(row[std::size_t(x)]) - light_.black) * light_.scale;
    }
  }

  // The same with its border; y may lie beyond the picture.
  void ReadPaddedRow(std::span<const std::uint8_t> bytes, std::size_t stride, int y, float* row) const {
    ReadRow(bytes, stride, Reflect(y, height_), row + kBorder);
    for (int i = 1; i <= kBorder; ++i) {
      row[kBorder - i] = row[kBorder + Reflect(-i, width_)];
      row[kBorder + width_ - 1 + i] = row[kBorder + Reflect(width_ - 1 + i, width_)];
    }
  }

  void RunBand(std::span<const std::uint8_t> bytes, std::size_t stride, int first, int last, Floats& scratch,
               PolarPlanes& planes, bool angles) const {
    float* rows = scratch.data();
    int next = first - reach_;  // row to be read
    const auto read_before = [&](int end) {
      for (; next < end; ++next)
        ReadPaddedRow(bytes, stride, next, rows + std::size_t(next - first + reach_) * stride_);
    };
    const bool guided = method_ == "difference";
    float *guide = rows + band_size_, *difference = rows + 2 * band_size_;
    if (guided) {
      read_before(last + reach_);
      std::array<float*, 6> more;
      for (std::size_t i = 0; i < 6; ++i) more[i] = rows + (3 + i) * band_size_;
      const Band band{rows, stride_, last - first + 2 * reach_, width_};
      GuideRows(band, reach_ - 1, reach_ + last - first + 1, more.data(), guide, difference);
    }
    for (int y = first; y < last; ++y) {
      read_before(y + reach_ + 1);  // late, so that it is still in the first-level cache
      const std::size_t at = std::size_t(y - first + reach_) * stride_ + kBorder;
      const OutRow out{planes.s0.row(y),
                       planes.s1.row(y),
                       planes.s2.row(y),
                       angles ? planes.dop.row(y) : nullptr,
                       angles ? planes.aop.row(y) : nullptr,
                       width_};
      if (method_ == "linear") {
        const float* around[7];
        for (std::size_t k = 0; k < 7; ++k) around[k] = rows + at + k * stride_ - 3 * stride_;
        LinearRow(around, kernels_[y & 1], out);
      } else {
        const float* here = (guided ? difference : rows) + at;
        BilinearRow(here - stride_, here, here + stride_, guided ? guide + at : nullptr, shares_[y & 1], out);
      }
    }
  }

  std::string method_;
  PixelFormat format_;
  int width_, height_, reach_ = 0;
  Light light_;
  StokesShares shares_[2];
  LinearRowKernels kernels_[2];
  std::size_t stride_ = 0, band_size_ = 0;
  tbb::enumerable_thread_specific<Floats> scratch_;  // bands of padded rows
};

FusedDemosaic::FusedDemosaic(const std::string& method, const Sensor& sensor, const PixelFormat& format,
                             int width, int height)
    : implementation_(std::make_unique<Implementation>(method, sensor, format, width, height)) {}
FusedDemosaic::~FusedDemosaic() = default;

void FusedDemosaic::operator()(std::span<const std::uint8_t> bytes, PolarPlanes& planes, bool angles,
                               std::size_t stride) {
  implementation_->Run(bytes, planes, angles, stride);
}

}  // namespace polarscan
