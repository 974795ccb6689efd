#include "rig/weld.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_map>

namespace volto::rig {
namespace {

struct DirectedEdge {
  std::uint32_t from, to;
};

// Edges that only one polygon has.
std::vector<DirectedEdge> boundaryEdges(const Mesh& mesh) {
  struct Use {
    std::uint64_t key;
    DirectedEdge edge;
  };
  std::vector<Use> uses;
  uses.reserve(mesh.corner_vertices.size());
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    const std::uint32_t first = mesh.polygon_start[p], last = mesh.polygon_start[p + 1];
    for (std::uint32_t c = first; c < last; ++c) {
      const std::uint32_t a = mesh.corner_vertices[c];
      const std::uint32_t b = mesh.corner_vertices[c + 1 < last ? c + 1 : first];
      if (a != b) uses.push_back({static_cast<std::uint64_t>(std::min(a, b)) << 32 | std::max(a, b), {a, b}});
    }
  }
  std::sort(uses.begin(), uses.end(), [](const Use& x, const Use& y) { return x.key < y.key; });
  std::vector<DirectedEdge> boundary;
  for (std::size_t i = 0; i < uses.size();) {
    std::size_t j = i + 1;
    while (j < uses.size() && uses[j].key == uses[i].key) ++j;
    if (j == i + 1) boundary.push_back(uses[i].edge);
    i = j;
  }
  return boundary;
}

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0U); }
  std::uint32_t find(std::uint32_t v) {
    while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
    return v;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

// Which of the listed vertices are at one position.
DisjointSets samePositions(const Mesh& mesh, const std::vector<std::uint32_t>& vertices) {
  DisjointSets same(mesh.vertexCount());
  const Eigen::Vector3d low = mesh.positions.colwise().minCoeff(), high = mesh.positions.colwise().maxCoeff();
  const double tolerance = 1e-6 * (high - low).norm();
  if (tolerance <= 0) return same;
  const double cell = 4 * tolerance;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells;
  const auto keyOf = [](std::int64_t x, std::int64_t y, std::int64_t z) {
    return static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15ULL ^
           static_cast<std::uint64_t>(y) * 0xC2B2AE3D27D4EB4FULL ^
           static_cast<std::uint64_t>(z) * 0x165667B19E3779F9ULL;
  };
  for (const std::uint32_t v : vertices) {
    const Eigen::Vector3d at = (mesh.positions.row(v).transpose() - low) / cell;
    const Eigen::Vector3d base = at.array().floor();
    // Within a cell of four tolerances, a neighbour can only be across the nearer wall of each axis.
    for (int corner = 0; corner < 8; ++corner) {
      std::array<std::int64_t, 3> index{};
      for (int axis = 0; axis < 3; ++axis) {
        index[axis] = static_cast<std::int64_t>(base[axis]);
        if ((corner >> axis & 1) != 0) index[axis] += at[axis] - base[axis] < 0.5 ? -1 : 1;
      }
      const auto found = cells.find(keyOf(index[0], index[1], index[2]));
      if (found == cells.end()) continue;
      for (const std::uint32_t u : found->second)
        if ((mesh.positions.row(u) - mesh.positions.row(v)).norm() <= tolerance) same.join(u, v);
    }
    cells[keyOf(static_cast<std::int64_t>(base[0]), static_cast<std::int64_t>(base[1]),
                static_cast<std::int64_t>(base[2]))]
        .push_back(v);
  }
  return same;
}

struct ChainPoint {
  double distance = std::numeric_limits<double>::infinity();
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
};

ChainPoint closestOnChain(const std::vector<Eigen::Vector3d>& chain, const Eigen::Vector3d& p) {
  ChainPoint best;
  for (std::size_t i = 1; i < chain.size(); ++i) {
    const Eigen::Vector3d along = chain[i] - chain[i - 1];
    const double length2 = along.squaredNorm();
    if (length2 <= 0) continue;
    const double s = std::clamp((p - chain[i - 1]).dot(along) / length2, 0.0, 1.0);
    const double distance = (chain[i - 1] + s * along - p).norm();
    if (distance < best.distance) best = {distance, along / std::sqrt(length2)};
  }
  return best;
}

bool runsAlong(const Slit& slit, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  if (slit.upper.size() < 2 || slit.lower.size() < 2) return false;
  const double tolerance = 0.03 * (slit.upper.back() - slit.upper.front()).norm();
  const Eigen::Vector3d middle = (a + b) / 2;
  const ChainPoint upper = closestOnChain(slit.upper, middle);
  const ChainPoint lower = closestOnChain(slit.lower, middle);
  const double parallel = 0.7 * (b - a).norm();
  return upper.distance < tolerance && lower.distance < tolerance && std::abs(upper.direction.dot(b - a)) > parallel;
}

}  // namespace

bool runsAlongSlit(std::span<const Slit> slits, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::any_of(slits.begin(), slits.end(), [&](const Slit& slit) { return runsAlong(slit, a, b); });
}

std::vector<std::uint32_t> weldSeams(const Mesh& mesh, std::span<const Slit> slits) {
  const std::vector<DirectedEdge> boundary = boundaryEdges(mesh);
  std::vector<std::uint32_t> vertices;
  for (const DirectedEdge& e : boundary) vertices.insert(vertices.end(), {e.from, e.to});
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  DisjointSets position = samePositions(mesh, vertices);

  struct PlacedEdge {
    std::uint64_t key;
    DirectedEdge edge;  // from the smaller position class to the larger
  };
  std::vector<PlacedEdge> placed;
  for (const DirectedEdge& e : boundary) {
    const std::uint32_t a = position.find(e.from), b = position.find(e.to);
    if (a == b) continue;
    placed.push_back(
        {static_cast<std::uint64_t>(std::min(a, b)) << 32 | std::max(a, b), a < b ? e : DirectedEdge{e.to, e.from}});
  }
  std::sort(placed.begin(), placed.end(), [](const PlacedEdge& x, const PlacedEdge& y) {
    return x.key != y.key ? x.key < y.key : x.edge.from < y.edge.from;
  });
  DisjointSets welded(mesh.vertexCount());
  for (std::size_t i = 1; i < placed.size(); ++i) {
    if (placed[i].key != placed[i - 1].key) continue;
    const Eigen::Vector3d a = mesh.positions.row(placed[i].edge.from), b = mesh.positions.row(placed[i].edge.to);
    if (runsAlongSlit(slits, a, b)) continue;
    welded.join(placed[i - 1].edge.from, placed[i].edge.from);
    welded.join(placed[i - 1].edge.to, placed[i].edge.to);
  }
  std::vector<std::uint32_t> same_as(mesh.vertexCount());
  for (std::uint32_t v = 0; v < same_as.size(); ++v) same_as[v] = welded.find(v);
  return same_as;
}

}  // namespace volto::rig
