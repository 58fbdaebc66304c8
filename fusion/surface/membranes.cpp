// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/membranes.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "core/conjugate_gradients.h"
#include "core/parallel.h"
#include "fusion/mesh_topology.h"

namespace polarscan {
namespace {

constexpr double kExact = 1e-5;        // of the mean edge: how far from their places vertices may stay
constexpr int kMostRounds = 300;       // twenty are usual
constexpr std::size_t kCoarsest = 64;  // unknowns that no further grid is made for
constexpr double kDamping = 2.0 / 3;   // of the Jacobi steps
constexpr double kStiff = 1.5;  // times the coarse grid's correction: steps are stiffer than what is smooth
constexpr auto kNowhere = std::numeric_limits<std::uint32_t>::max();

using Three = Eigen::Array3d;  // one number for each coordinate
using Coordinates = std::vector<Three>;

// f(begin, end) for blocks that do not depend on the number of threads; the sum of what it returns.
template <class F>
Three SumOfBlocks(std::size_t count, const F& f) {
  constexpr std::size_t kBlock = 4096;
  std::vector<Three> sums((count + kBlock - 1) / kBlock);
  ParallelFor(0, int(sums.size()), [&](int i) {
    const std::size_t begin = std::size_t(i) * kBlock;
    sums[std::size_t(i)] = f(begin, std::min(begin + kBlock, count));
  });
  Three sum = Three::Zero();
  for (const Three& s : sums) sum += s;
  return sum;
}

template <class F>
void ForEach(std::size_t count, const F& f) {
  SumOfBlocks(count, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) f(i);
    return Three::Zero().eval();
  });
}

// Lists of numbers, all one after the other.
struct Lists {
  std::vector<std::size_t> begin = {0};
  std::vector<std::uint32_t> entries;
  std::size_t size() const { return begin.size() - 1; }
  std::span<const std::uint32_t> Of(std::size_t i) const {
    return std::span(entries).subspan(begin[i], begin[i + 1] - begin[i]);
  }
};

// diagonal(i) x(i) - sum over the links of weight x(other).
struct Laplacian {
  Lists links;
  std::vector<float> weights;  // of the links
  std::vector<double> diagonal;
  std::size_t size() const { return diagonal.size(); }

  Three Row(const Coordinates& x, std::size_t i) const {
    Three sum = diagonal[i] * x[i];
    for (std::size_t k = links.begin[i]; k < links.begin[i + 1]; ++k)
      sum -= double(weights[k]) * x[links.entries[k]];
    return sum;
  }
};

// Each unknown's aggregate: a vertex and those around it; what is left over joins a neighbour's.
std::vector<std::uint32_t> Aggregate(const Laplacian& system, std::size_t& count) {
  std::vector<std::uint32_t> aggregate(system.size(), kNowhere);
  count = 0;
  for (std::size_t i = 0; i < system.size(); ++i) {
    const auto around = system.links.Of(i);
    if (aggregate[i] != kNowhere ||
        std::ranges::any_of(around, [&](std::uint32_t j) { return aggregate[j] != kNowhere; }))
      continue;
    aggregate[i] = std::uint32_t(count);
    for (std::uint32_t j : around) aggregate[j] = std::uint32_t(count);
    ++count;
  }
  const std::vector<std::uint32_t> roots = aggregate;
  for (std::size_t i = 0; i < system.size(); ++i)
    for (std::uint32_t j : system.links.Of(i))
      if (aggregate[i] == kNowhere) aggregate[i] = roots[j];
  return aggregate;
}

Lists Members(const std::vector<std::uint32_t>& aggregate, std::size_t count) {
  Lists members;
  members.begin.assign(count + 1, 0);
  for (std::uint32_t a : aggregate) ++members.begin[a + 1];
  for (std::size_t a = 0; a < count; ++a) members.begin[a + 1] += members.begin[a];
  members.entries.resize(aggregate.size());
  std::vector<std::size_t> place = members.begin;
  for (std::size_t i = 0; i < aggregate.size(); ++i)
    members.entries[place[aggregate[i]]++] = std::uint32_t(i);
  return members;
}

// The system of values that are equal within an aggregate.
Laplacian Coarsen(const Laplacian& fine, const std::vector<std::uint32_t>& aggregate, const Lists& members) {
  using Link = std::pair<std::uint32_t, float>;
  Laplacian coarse;
  coarse.diagonal.assign(members.size(), 0);
  std::vector<std::vector<Link>> links(members.size());
  ForEach(members.size(), [&](std::size_t a) {
    std::vector<Link>& own = links[a];
    for (std::uint32_t i : members.Of(a)) {
      coarse.diagonal[a] += fine.diagonal[i];
      for (std::size_t k = fine.links.begin[i]; k < fine.links.begin[i + 1]; ++k)
        own.emplace_back(aggregate[fine.links.entries[k]], fine.weights[k]);
    }
    std::ranges::sort(own, {}, &Link::first);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < own.size(); ++k) {
      if (own[k].first == a)
        coarse.diagonal[a] -= double(own[k].second);
      else if (kept > 0 && own[kept - 1].first == own[k].first)
        own[kept - 1].second += own[k].second;
      else
        own[kept++] = own[k];
    }
    own.resize(kept);
    if (coarse.diagonal[a] < 0.5) coarse.diagonal[a] = 1;  // a whole piece without a rim
  });
  for (const std::vector<Link>& own : links) {
    for (const auto& [other, weight] : own)
      coarse.links.entries.push_back(other), coarse.weights.push_back(weight);
    coarse.links.begin.push_back(coarse.links.entries.size());
  }
  return coarse;
}

// One W-cycle: a symmetric positive approximation of the inverse.
class Multigrid {
 public:
  Multigrid(const Laplacian& finest, const Progress& progress) : finest_(finest) {
    while (System(grids_.size()).size() > kCoarsest) {
      progress.Check();
      const Laplacian& fine = System(grids_.size());
      std::size_t count = 0;
      std::vector<std::uint32_t> aggregate = Aggregate(fine, count);
      if (count == fine.size()) break;  // none has a link: the Jacobi steps solve it
      Lists members = Members(aggregate, count);
      Laplacian coarse = Coarsen(fine, aggregate, members);
      grids_.push_back({std::move(aggregate), std::move(members), std::move(coarse)});
    }
  }

  void Apply(const Coordinates& right, Coordinates& x, std::size_t level = 0) const {
    const Laplacian& system = System(level);
    if (level == grids_.size()) return SolveCoarsest(system, right, x);
    x.resize(right.size());
    ForEach(system.size(), [&](std::size_t i) { x[i] = kDamping / system.diagonal[i] * right[i]; });
    const Grid& grid = grids_[level];
    Coordinates rest(grid.members.size()), correction;
    ForEach(grid.members.size(), [&](std::size_t a) {
      Three sum = Three::Zero();
      for (std::uint32_t i : grid.members.Of(a)) sum += right[i] - system.Row(x, i);
      rest[a] = sum;
    });
    Apply(rest, correction, level + 1);
    if (level + 1 < grids_.size()) {  // once more for what is left: a W-cycle
      Coordinates left(rest.size()), more;
      ForEach(rest.size(), [&](std::size_t a) { left[a] = rest[a] - grid.system.Row(correction, a); });
      Apply(left, more, level + 1);
      ForEach(rest.size(), [&](std::size_t a) { correction[a] += more[a]; });
    }
    ForEach(system.size(), [&](std::size_t i) { x[i] += kStiff * correction[grid.aggregate[i]]; });
    Smooth(system, right, x);
  }

 private:
  struct Grid {
    std::vector<std::uint32_t> aggregate;  // of each unknown of the finer grid
    Lists members;                         // of each aggregate
    Laplacian system;                      // of the aggregates
  };

  const Laplacian& System(std::size_t level) const { return level ? grids_[level - 1].system : finest_; }

  static void Smooth(const Laplacian& system, const Coordinates& right, Coordinates& x) {
    Coordinates next(x.size());
    ForEach(system.size(), [&](std::size_t i) {
      next[i] = x[i] + kDamping / system.diagonal[i] * (right[i] - system.Row(x, i));
    });
    x.swap(next);
  }

  static void SolveCoarsest(const Laplacian& system, const Coordinates& right, Coordinates& x) {
    x.assign(right.size(), Three::Zero());
    if (system.links.entries.empty()) {
      ForEach(system.size(), [&](std::size_t i) { x[i] = right[i] / system.diagonal[i]; });
      return;
    }
    for (int step = 0; step < 40; ++step) Smooth(system, right, x);
  }

  const Laplacian& finest_;
  std::vector<Grid> grids_;
};

Three Dot(const Coordinates& a, const Coordinates& b) {
  return SumOfBlocks(a.size(), [&](std::size_t begin, std::size_t end) {
    Three sum = Three::Zero();
    for (std::size_t i = begin; i < end; ++i) sum += a[i] * b[i];
    return sum;
  });
}

// What ConjugateGradients asks for. near: the preconditioned residual.
struct Iterate {
  const Laplacian& system;
  const Multigrid preconditioner;
  Coordinates& x;
  Coordinates residual, direction, near, product;

  Three Curvature() {
    ForEach(x.size(), [&](std::size_t k) { product[k] = system.Row(direction, k); });
    return Dot(direction, product);
  }
  Three UpdateSolution(const Three& length) {
    ForEach(x.size(), [&](std::size_t k) {
      x[k] += length * direction[k];
      residual[k] -= length * product[k];
    });
    preconditioner.Apply(residual, near);
    return Dot(residual, near);
  }
  void UpdateDirection(const Three& share) {
    ForEach(x.size(), [&](std::size_t k) { direction[k] = near[k] + share * direction[k]; });
  }
};

// Each coordinate for itself, until the steps that are left are shorter than `exact` in the mean.
void Solve(const Laplacian& system, const Coordinates& right, double exact, Coordinates& x,
           Progress& progress) {
  const std::size_t count = system.size();
  Iterate at{system, Multigrid(system, progress), x, Coordinates(count), {}, {}, Coordinates(count)};
  ForEach(count, [&](std::size_t i) { at.residual[i] = right[i] - system.Row(x, i); });
  at.preconditioner.Apply(at.residual, at.near);
  at.direction = at.near;
  bool first = true;
  ConjugateGradients(at, Dot(at.residual, at.near), kMostRounds, [&](const Three&) {
    if (!std::exchange(first, false)) progress.Advance();
    progress.Check();
    return std::sqrt(Dot(at.near, at.near).sum() / double(count)) > exact;
  });
}

}  // namespace

void StretchMembranes(TriangleMesh& mesh, const std::vector<bool>& free, Progress& progress) {
  std::vector<std::uint32_t> unknown(mesh.vertices.size(), kNowhere), members;
  for (std::uint32_t v = 0; v < free.size(); ++v)
    if (free[v]) unknown[v] = std::uint32_t(members.size()), members.push_back(v);
  if (members.empty()) return;
  progress.Begin("filling holes", 0, "round");
  const VertexNeighbours neighbours(mesh.vertices.size(), mesh.triangles);
  progress.Check();
  Laplacian system;
  Coordinates known(members.size(), Three::Zero()), places(members.size());
  for (std::size_t i = 0; i < members.size(); ++i) {
    places[i] = mesh.vertices[members[i]].array();
    const auto around = neighbours.Of(members[i]);
    for (std::uint32_t other : around) {
      if (unknown[other] == kNowhere)
        known[i] += mesh.vertices[other].array();
      else
        system.links.entries.push_back(unknown[other]);
    }
    system.links.begin.push_back(system.links.entries.size());
    system.diagonal.push_back(std::max<double>(1, double(around.size())));
  }
  system.weights.assign(system.links.entries.size(), 1);
  Solve(system, known, kExact * MeanEdge(mesh), places, progress);
  for (std::size_t i = 0; i < members.size(); ++i) mesh.vertices[members[i]] = places[i].matrix();
}

}  // namespace polarscan
