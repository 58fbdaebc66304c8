// SPDX-License-Identifier: Apache-2.0
#include "report/scene/sample.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "core/error.h"
#include "core/formats/ply.h"
#include "core/random.h"
#include "core/statistics.h"

namespace polarscan {
namespace {

using Columns = std::map<std::string, std::vector<double>>;
using Rows = std::vector<std::size_t>;

constexpr double kFarOutRadii = 6;

bool Has(const Columns& columns, std::initializer_list<const char*> names) {
  return std::ranges::all_of(names, [&](const char* name) { return columns.contains(name); });
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

Eigen::Vector3d Medians(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d medians;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector3d& p : points) values.push_back(p[axis]);
    medians[axis] = Quantile(values, 0.5);
  }
  return medians;
}

// Leaves the points that lie near the bulk, and their rows.
void KeepNear(CloudSample& sample, Rows& rows) {
  sample.center = Medians(sample.points);
  std::vector<double> distances;
  for (const Eigen::Vector3d& p : sample.points) distances.push_back((p - sample.center).norm());
  sample.radius = std::max(Quantile(distances, 0.95), 1e-9);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    if (distances[i] > kFarOutRadii * sample.radius) continue;
    sample.points[kept] = sample.points[i];
    rows[kept++] = rows[i];
  }
  sample.outside = sample.points.size() - kept;
  sample.points.resize(kept);
  rows.resize(kept);
}

Columns ReadVertices(const std::filesystem::path& ply) {
  PlyFile file = ReadPly(ply);
  const auto vertex = file.find("vertex");
  if (vertex == file.end() || vertex->second.count == 0 || !Has(vertex->second.columns, {"x", "y", "z"}))
    throw Error("the cloud has no points", ply.string());
  return std::move(vertex->second.columns);
}

void AddErrors(const std::filesystem::path& path, Columns& columns) {
  if (path.empty()) return;
  Columns errors = ReadVertices(path);
  if (!errors.contains("error") || errors["error"].size() != columns["x"].size())
    throw Error("these are not the errors of this cloud's points", path.string(),
                "Run polarscan evaluate again");
  columns["error"] = std::move(errors["error"]);
}

}  // namespace

CloudSample SampleCloud(const std::filesystem::path& ply, const std::filesystem::path& errors,
                        std::size_t max_points, const Eigen::Matrix3d& display_from_world) {
  Columns columns = ReadVertices(ply);
  AddErrors(errors, columns);
  CloudSample sample;
  sample.total = columns["x"].size();
  Rows rows;
  for (std::size_t row : ChooseRows(sample.total, max_points)) {
    const Eigen::Vector3d point = display_from_world * At(columns, row, "x", "y", "z");
    if (point.allFinite()) sample.points.push_back(point), rows.push_back(row);
  }
  if (rows.empty()) throw Error("the cloud's points have no finite place", ply.string());
  KeepNear(sample, rows);
  sample.spacing = Spacing(sample.points, sample.radius);
  if (Has(columns, {"nx", "ny", "nz"}))
    for (std::size_t row : rows)
      sample.normals.push_back(display_from_world * At(columns, row, "nx", "ny", "nz"));
  for (const auto& [name, column] : columns)
    for (std::size_t row : rows) sample.values[name].push_back(column[row]);
  return sample;
}

}  // namespace polarscan
