// SPDX-License-Identifier: Apache-2.0
#include "demosaic/sensor/lit_mosaic.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "core/error.h"
#include "core/parallel.h"
#include "demosaic/calibration/cell.h"

namespace polarscan {
namespace {

void CheckCorrection(const Image<float>& counts, const Sensor& sensor, const MosaicCorrection& correction) {
  if (correction.empty()) return;
  const Image<float>& map = correction.responses.empty() ? correction.black_dn : correction.responses.a0;
  if (!SameSize(map, counts))
    throw Error(fmt::format("the calibration is for {}x{} pixels", map.width(), map.height()),
                fmt::format("a picture of {}x{}", counts.width(), counts.height()));
  if (sensor.gamma != 1) throw Error("a calibration needs counts that are linear in light", "--gamma");
}

// One cell on its way; the samples row by row.
struct Cell {
  CellSamples samples;
  std::array<bool, 4> clipped{}, defect{};
  std::array<int, 4> angles_deg{};
  std::array<Response, 4> responses;  // of a defect pixel: an ideal one's, which is what it shall look like

  int Missing() const {
    int count = 0;
    for (std::size_t i = 0; i < 4; ++i) count += clipped[i] || defect[i];
    return count;
  }
};

class Corrector {
 public:
  Corrector(const Image<float>& light, const Image<std::uint8_t>& clipped, const Layout& layout,
            const ResponseMap& responses)
      : light_(light), clipped_(clipped), layout_(layout), responses_(responses) {}

  // Of the cell whose top-left pixel is (x, y).
  Cell Read(int x, int y) const {
    Cell cell;
    for (std::size_t i = 0; i < 4; ++i) {
      const int u = x + int(i & 1), v = y + int(i >> 1);
      cell.samples[int(i)] = light_(u, v);
      cell.clipped[i] = clipped_(u, v) != 0;
      cell.angles_deg[i] = layout_.AngleAt(u, v);
      cell.responses[i] = IdealResponse(cell.angles_deg[i]);
      if (responses_.empty()) continue;
      const Response response = responses_.At(u, v);
      cell.defect[i] = response.Defect();
      if (!response.Defect()) cell.responses[i] = response;
    }
    return cell;
  }

  bool IsClipped(int x, int y) const {
    return clipped_(x, y) || clipped_(x + 1, y) || clipped_(x, y + 1) || clipped_(x + 1, y + 1);
  }

  // Fills the one sample that is missing; what became of the missing ones.
  static SampleState Recover(Cell& cell) {
    const int count = cell.Missing();
    if (count != 1) return count == 0 ? SampleState::kMeasured : SampleState::kLost;
    std::size_t at = 0;
    while (!cell.clipped[at] && !cell.defect[at]) ++at;
    const std::optional<float> value = MissingSample(ToCellMatrix(cell.responses), cell.samples, int(at));
    if (!value) return SampleState::kLost;
    cell.samples[int(at)] = cell.clipped[at] ? std::max(cell.samples[int(at)], *value) : *value;
    return SampleState::kRecovered;
  }

  void Correct(int x, int y, LitMosaic& mosaic) const {
    if (responses_.empty() && !IsClipped(x, y)) return;  // the mosaic holds the light as it is
    Cell cell = Read(x, y);
    const SampleState missing = Recover(cell);
    if (!responses_.empty() && missing != SampleState::kLost) {
      std::array<Response, 4> ideal;
      for (std::size_t i = 0; i < 4; ++i) ideal[i] = IdealResponse(cell.angles_deg[i]);
      cell.samples = CorrectCell(ToCellMatrix(cell.responses), ToCellMatrix(ideal), cell.samples);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      const int u = x + int(i & 1), v = y + int(i >> 1);
      mosaic.light(u, v) = cell.samples[int(i)];
      mosaic.state(u, v) = cell.clipped[i] || cell.defect[i] ? missing : SampleState::kMeasured;
    }
  }

 private:
  const Image<float>& light_;
  const Image<std::uint8_t>& clipped_;
  const Layout& layout_;
  const ResponseMap& responses_;
};

}  // namespace

LitMosaic ToLitMosaic(const Image<float>& counts, const Sensor& sensor, const MosaicCorrection& correction) {
  CheckCorrection(counts, sensor, correction);
  const Image<float> light = ToLight(counts, sensor, correction.black_dn);
  const Image<std::uint8_t> clipped = Clipped(counts, sensor);
  const int width = counts.width(), height = counts.height();
  LitMosaic mosaic{light, Image<SampleState>(width, height, SampleState::kMeasured)};
  if (width < 2 || height < 2) return mosaic;
  const Corrector corrector(light, clipped, sensor.layout, correction.responses);
  // An odd last row or column is the second one of a cell of its own; even cells come after and decide.
  if (height % 2)
    for (int x = 0; x + 1 < width; x += 2) corrector.Correct(x, height - 2, mosaic);
  ParallelFor(0, height / 2, [&](int j) {
    if (width % 2) corrector.Correct(width - 2, 2 * j, mosaic);
    for (int x = 0; x + 1 < width; x += 2) corrector.Correct(x, 2 * j, mosaic);
  });
  if (width % 2 && height % 2) {
    LitMosaic corner = mosaic;
    corrector.Correct(width - 2, height - 2, corner);
    mosaic.light(width - 1, height - 1) = corner.light(width - 1, height - 1);
    mosaic.state(width - 1, height - 1) = corner.state(width - 1, height - 1);
  }
  return mosaic;
}

SampleState RecoverClipped(std::array<float, 4>& light, const std::array<bool, 4>& clipped) {
  const auto count = std::ranges::count(clipped, true);
  if (count != 1) return count == 0 ? SampleState::kMeasured : SampleState::kLost;
  const std::size_t at = std::size_t(std::ranges::find(clipped, true) - clipped.begin());
  const float value = light[(at + 1) % 4] + light[(at + 3) % 4] - light[(at + 2) % 4];
  light[at] = std::max(light[at], value);
  return SampleState::kRecovered;
}

}  // namespace polarscan
