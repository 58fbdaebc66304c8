// SPDX-License-Identifier: Apache-2.0
#include "fusion/mesh_topology.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

namespace polarscan {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;
constexpr int kNone = -1;

// Disjoint sets with path halving; the smaller index is the set's name.
class Sets {
 public:
  explicit Sets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t Find(std::uint32_t a) {
    while (parent_[a] != a) a = parent_[a] = parent_[parent_[a]];
    return a;
  }
  void Join(std::uint32_t a, std::uint32_t b) {
    a = Find(a), b = Find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

// Each edge of each triangle in its direction, sorted.
std::vector<Edge> DirectedEdges(std::span<const Triangle> triangles) {
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (const Triangle& t : triangles)
    for (std::size_t i = 0; i < 3; ++i) edges.emplace_back(t[i], t[(i + 1) % 3]);
  tbb::parallel_sort(edges.begin(), edges.end());
  return edges;
}

}  // namespace

VertexNeighbours::VertexNeighbours(std::size_t vertices, std::span<const Triangle> triangles)
    : begin_(vertices + 1, 0), first_(vertices + 1, 0), triangles_(3 * triangles.size()) {
  std::vector<Edge> edges = DirectedEdges(triangles);
  const std::size_t count = edges.size();
  for (std::size_t i = 0; i < count; ++i) edges.emplace_back(edges[i].second, edges[i].first);
  tbb::parallel_sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  neighbours_.reserve(edges.size());
  for (const auto& [from, to] : edges) ++begin_[from + 1], neighbours_.push_back(to);
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());

  for (const Triangle& t : triangles)
    for (std::uint32_t v : t) ++first_[v + 1];
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  std::vector<std::size_t> place = first_;
  for (std::uint32_t i = 0; i < triangles.size(); ++i)
    for (std::uint32_t v : triangles[i]) triangles_[place[v]++] = i;
}

Pieces FindPieces(std::size_t vertices, std::span<const Triangle> triangles) {
  Sets sets(vertices);
  for (const Triangle& t : triangles) sets.Join(t[0], t[1]), sets.Join(t[0], t[2]);
  Pieces pieces;
  std::vector<int> number(vertices, kNone);
  for (const Triangle& t : triangles) {
    int& name = number[sets.Find(t[0])];
    if (name == kNone) name = pieces.count++;
    pieces.of_triangle.push_back(name);
  }
  return pieces;
}

std::vector<std::vector<std::uint32_t>> BorderLoops(std::span<const Triangle> triangles) {
  const std::vector<Edge> edges = DirectedEdges(triangles);
  std::multimap<std::uint32_t, std::uint32_t> next;  // against the direction of the border's own triangles
  for (const auto& [from, to] : edges)
    if (!std::binary_search(edges.begin(), edges.end(), Edge(to, from))) next.emplace(to, from);
  std::vector<std::vector<std::uint32_t>> loops;
  while (!next.empty()) {
    std::vector<std::uint32_t> loop;
    for (auto at = next.begin(); at != next.end(); at = next.find(loop.back())) {
      if (loop.empty()) loop.push_back(at->first);
      if (at->second != loop.front()) loop.push_back(at->second);
      const bool closed = at->second == loop.front();
      next.erase(at);
      if (closed) break;
    }
    if (loop.size() > 2) loops.push_back(std::move(loop));
  }
  return loops;
}

KeptPart KeepTriangles(const TriangleMesh& mesh, const std::vector<bool>& keep) {
  constexpr auto kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> place(mesh.vertices.size(), kUnused);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    if (keep[i])
      for (std::uint32_t v : mesh.triangles[i]) place[v] = 0;
  KeptPart part;
  for (std::uint32_t v = 0; v < place.size(); ++v) {
    if (place[v] == kUnused) continue;
    place[v] = std::uint32_t(part.origin.size());
    part.origin.push_back(v);
    part.mesh.vertices.push_back(mesh.vertices[v]);
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    if (keep[i]) part.mesh.triangles.push_back({place[t[0]], place[t[1]], place[t[2]]});
  }
  return part;
}

TriangleMesh Subdivided(const TriangleMesh& mesh, std::vector<bool>& marks) {
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) edges.emplace_back(std::minmax(t[i], t[(i + 1) % 3]));
  tbb::parallel_sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto found = std::lower_bound(edges.begin(), edges.end(), Edge(std::minmax(a, b)));
    return std::uint32_t(mesh.vertices.size() + std::size_t(found - edges.begin()));
  };
  TriangleMesh fine{mesh.vertices, {}, {}};
  for (const auto& [a, b] : edges) {
    const Eigen::Vector3d along = mesh.vertices[b] - mesh.vertices[a];
    const Eigen::Vector3d &na = mesh.normals[a], &nb = mesh.normals[b];
    fine.vertices.push_back(mesh.vertices[a] + along / 2 + (along.dot(nb) * nb - along.dot(na) * na) / 8);
    marks.push_back(marks[a] && marks[b]);
  }
  fine.triangles.reserve(4 * mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    fine.triangles.insert(fine.triangles.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  ComputeVertexNormals(fine);
  return fine;
}

double MeanEdge(const TriangleMesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) sum += (mesh.vertices[t[i]] - mesh.vertices[t[(i + 1) % 3]]).norm();
  return sum / (3 * double(mesh.triangles.size()));
}

double TriangleArea(const TriangleMesh& mesh, const Triangle& t) {
  const Eigen::Vector3d& a = mesh.vertices[t[0]];
  return (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm() / 2;
}

}  // namespace polarscan
