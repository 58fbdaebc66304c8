// SPDX-License-Identifier: Apache-2.0
#include "apps/report_cloud.h"

#include <cstdint>
#include <set>
#include <tuple>

#include "apps/report_util.h"
#include "core/error.h"
#include "core/ply.h"
#include "core/random.h"

namespace polarscan {
namespace {

using Columns = std::map<std::string, std::vector<double>>;
using Rows = std::vector<std::size_t>;

constexpr double kFarOutRadii = 6;

bool Has(const Columns& columns, std::initializer_list<const char*> names) {
  return std::all_of(names.begin(), names.end(), [&](const char* name) { return columns.count(name) > 0; });
}

// Exactly `wanted` of `count` rows, each with the same chance, in order (Knuth, volume 2, algorithm 3.4.2 S).
Rows ChooseRows(std::size_t count, std::size_t wanted) {
  Rows rows;
  Random random(1);
  for (std::size_t i = 0; i < count && rows.size() < wanted; ++i)
    if (double(count - i) * random.Uniform() < double(wanted - rows.size())) rows.push_back(i);
  return rows;
}

Eigen::Vector3d At(const Columns& columns, std::size_t row, const char* x, const char* y, const char* z) {
  return {columns.at(x)[row], columns.at(y)[row], columns.at(z)[row]};
}

std::vector<double> Pick(const std::vector<double>& column, const Rows& rows) {
  std::vector<double> values;
  for (std::size_t row : rows) values.push_back(column[row]);
  return values;
}

// Typical distance between neighbours: of n points that touch m cells of a grid, a surface has the area m
// cells.
double Spacing(const std::vector<Eigen::Vector3d>& points, double radius) {
  const double cell = std::max(radius / 64, 1e-12);
  std::set<std::tuple<int, int, int>> cells;
  for (const Eigen::Vector3d& p : points)
    cells.insert(
        {int(std::floor(p.x() / cell)), int(std::floor(p.y() / cell)), int(std::floor(p.z() / cell))});
  return cell * std::sqrt(double(cells.size()) / double(points.size()));
}

template <class T>
void Append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

nlohmann::json ToArray(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

// Leaves the points that lie near the bulk; fills in center, radius, outside.
std::vector<Eigen::Vector3d> KeepNear(const std::vector<Eigen::Vector3d>& points, Rows& rows,
                                      nlohmann::json& facts) {
  Eigen::Vector3d center;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector3d& p : points) values.push_back(p[axis]);
    center[axis] = Quantile(values, 0.5);
  }
  std::vector<double> distances;
  for (const Eigen::Vector3d& p : points) distances.push_back((p - center).norm());
  const double radius = std::max(Quantile(distances, 0.95), 1e-9);
  std::vector<Eigen::Vector3d> kept;
  Rows kept_rows;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (distances[i] <= kFarOutRadii * radius) kept.push_back(points[i]), kept_rows.push_back(rows[i]);
  facts["center"] = ToArray(center);
  facts["radius"] = radius;
  facts["outside"] = points.size() - kept.size();
  rows = kept_rows;
  return kept;
}

void PackPositions(const std::vector<Eigen::Vector3d>& points, ReportCloud& cloud) {
  Eigen::Vector3d low = points[0], high = points[0];
  for (const Eigen::Vector3d& p : points) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const Eigen::Vector3d size = (high - low).cwiseMax(1e-9);
  for (const Eigen::Vector3d& p : points)
    for (int axis = 0; axis < 3; ++axis)
      Append(cloud.bytes, std::uint16_t(std::lround((p[axis] - low[axis]) / size[axis] * 65535)));
  cloud.facts["low"] = ToArray(low);
  cloud.facts["size"] = ToArray(size);
}

void PackColours(const Columns& columns, const Rows& rows, ReportCloud& cloud) {
  if (!Has(columns, {"red", "green", "blue"})) return;
  for (std::size_t row : rows)
    for (const char* name : {"red", "green", "blue"})
      Append(cloud.bytes, std::uint8_t(std::clamp(columns.at(name)[row], 0., 255.)));
  cloud.facts["layers"].push_back({{"key", "colour"}, {"label", "Colour"}});
}

void PackNormals(const Columns& columns, const Rows& rows, const Eigen::Matrix3d& display_from_world,
                 ReportCloud& cloud) {
  if (!Has(columns, {"nx", "ny", "nz"})) return;
  for (std::size_t row : rows) {
    const Eigen::Vector3d normal = display_from_world * At(columns, row, "nx", "ny", "nz");
    for (int axis = 0; axis < 3; ++axis)
      Append(cloud.bytes, std::int8_t(std::lround(127 * std::clamp(normal[axis], -1., 1.))));
  }
  cloud.facts["layers"].push_back({{"key", "normal"}, {"label", "Normal"}});
}

void PackScalar(const std::string& key, const std::string& label, double low, double high,
                const std::vector<double>& values, ReportCloud& cloud) {
  const double size = std::max(high - low, 1e-9);
  for (double value : values)
    Append(cloud.bytes, std::uint8_t(std::lround(255 * std::clamp((value - low) / size, 0., 1.))));
  cloud.facts["layers"].push_back({{"key", key}, {"label", label}, {"low", low}, {"high", high}});
}

void PackScalars(const Columns& columns, const Rows& rows, double dop_full, ReportCloud& cloud) {
  if (Has(columns, {"dop"})) {
    const std::vector<double> dop = Pick(columns.at("dop"), rows);
    const bool any = std::any_of(dop.begin(), dop.end(), [](double value) { return value > 0; });
    if (any) PackScalar("dop", "DoP", 0, dop_full > 0 ? dop_full : DopFullScale(dop), dop, cloud);
  }
  for (const auto& [key, label] : {std::pair{"confidence", "Confidence"}, std::pair{"views", "Views"}}) {
    if (!Has(columns, {key})) continue;
    const std::vector<double> values = Pick(columns.at(key), rows);
    PackScalar(key, label, Quantile(values, 0.02), Quantile(values, 0.98), values, cloud);
  }
}

}  // namespace

ReportCloud PackCloud(const std::filesystem::path& ply, std::size_t max_points, double dop_full,
                      const Eigen::Matrix3d& display_from_world) {
  const PlyFile file = ReadPly(ply);
  const auto vertex = file.find("vertex");
  if (vertex == file.end() || vertex->second.count == 0 || !Has(vertex->second.columns, {"x", "y", "z"}))
    throw Error("the cloud has no points", ply.string());
  const Columns& columns = vertex->second.columns;

  ReportCloud cloud;
  Rows rows;
  std::vector<Eigen::Vector3d> points;
  for (std::size_t row : ChooseRows(vertex->second.count, max_points)) {
    const Eigen::Vector3d point = display_from_world * At(columns, row, "x", "y", "z");
    if (point.allFinite()) points.push_back(point), rows.push_back(row);
  }
  if (points.empty()) throw Error("the cloud's points have no finite place", ply.string());
  points = KeepNear(points, rows, cloud.facts);
  cloud.facts["total"] = vertex->second.count;
  cloud.facts["shown"] = rows.size();
  cloud.facts["spacing"] = Spacing(points, cloud.facts["radius"]);
  cloud.facts["layers"] = nlohmann::json::array();
  PackPositions(points, cloud);
  PackColours(columns, rows, cloud);
  PackNormals(columns, rows, display_from_world, cloud);
  PackScalars(columns, rows, dop_full, cloud);
  return cloud;
}

}  // namespace polarscan
