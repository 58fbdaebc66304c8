// SPDX-License-Identifier: Apache-2.0
#include "report/scene/cloud.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/statistics.h"
#include "demosaic/false_colour.h"

namespace polarscan {
namespace {

void PackColours(const CloudSample& sample, ReportCloud& cloud) {
  if (!sample.Has("red") || !sample.Has("green") || !sample.Has("blue")) return;
  const auto &red = sample.values.at("red"), &green = sample.values.at("green"),
             &blue = sample.values.at("blue");
  for (std::size_t i = 0; i < red.size(); ++i)
    for (double value : {red[i], green[i], blue[i]})
      cloud.bytes += char(std::uint8_t(std::clamp(value, 0., 255.)));
  cloud.facts["layers"].push_back({{"key", "colour"}, {"label", "Colour"}});
}

struct ScalarLayer {
  std::string key, label;
  double low, high;
  bool open;  // greater values than `high` are usual
};

void PackScalar(const ScalarLayer& layer, const std::vector<double>& values, ReportCloud& cloud) {
  const double size = std::max(layer.high - layer.low, 1e-9);
  std::string& bytes = cloud.scalars[layer.key];
  for (double value : values)
    bytes += char(std::lround(255 * std::clamp((value - layer.low) / size, 0., 1.)));
  cloud.bytes += bytes;
  cloud.facts["layers"].push_back({{"key", layer.key},
                                   {"label", layer.label},
                                   {"low", layer.low},
                                   {"high", layer.high},
                                   {"open", layer.open}});
}

void PackScalars(const CloudSample& sample, ReportCloud& cloud) {
  if (sample.Has("dop")) {
    const std::vector<double>& dop = sample.values.at("dop");
    const bool any = std::ranges::any_of(dop, [](double value) { return value > 0; });
    if (any) PackScalar({"dop", "DoP", 0, DopFullScale(dop), false}, dop, cloud);
  }
  for (const auto& [key, label] : {std::pair{"confidence", "Confidence"}, std::pair{"views", "Views"}}) {
    if (!sample.Has(key)) continue;
    const std::vector<double>& values = sample.values.at(key);
    PackScalar({key, label, Quantile(values, 0.02), Quantile(values, 0.98), false}, values, cloud);
  }
  if (sample.Has("error")) {
    const std::vector<double>& errors = sample.values.at("error");
    PackScalar({"error", "Error", 0, Quantile(errors, 0.95), true}, errors, cloud);
  }
}

}  // namespace

nlohmann::json ToArray(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Eigen::Vector3d FromArray(const nlohmann::json& array) {
  return {array.at(0).get<double>(), array.at(1).get<double>(), array.at(2).get<double>()};
}

void PackPositions(const std::vector<Eigen::Vector3d>& points, nlohmann::json& facts, std::string& bytes) {
  Eigen::Vector3d low = points[0], high = points[0];
  for (const Eigen::Vector3d& p : points) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const Eigen::Vector3d size = (high - low).cwiseMax(1e-9);
  for (const Eigen::Vector3d& p : points)
    for (int axis = 0; axis < 3; ++axis) {
      const auto q = std::uint16_t(std::lround((p[axis] - low[axis]) / size[axis] * 65535));
      bytes += {char(q & 255), char(q >> 8)};
    }
  facts["low"] = ToArray(low);
  facts["size"] = ToArray(size);
}

void PackNormals(const std::vector<Eigen::Vector3d>& normals, std::string& bytes) {
  for (const Eigen::Vector3d& n : normals)
    for (double value : n) bytes += char(std::lround(127 * std::clamp(value, -1., 1.)));
}

ReportCloud PackCloud(const CloudSample& sample) {
  ReportCloud cloud;
  cloud.facts = {{"total", sample.total},
                 {"shown", sample.points.size()},
                 {"outside", sample.outside},
                 {"center", ToArray(sample.center)},
                 {"radius", sample.radius},
                 {"spacing", sample.spacing},
                 {"layers", nlohmann::json::array()}};
  PackPositions(sample.points, cloud.facts, cloud.bytes);
  PackColours(sample, cloud);
  if (!sample.normals.empty()) {
    PackNormals(sample.normals, cloud.bytes);
    cloud.facts["layers"].push_back({{"key", "normal"}, {"label", "Normal"}});
  }
  PackScalars(sample, cloud);
  return cloud;
}

}  // namespace polarscan
