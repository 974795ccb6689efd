#include "rig/t_vertices.h"

#include <algorithm>
#include <tuple>

namespace volto::rig {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;  // smaller index first

std::vector<Edge> openEdges(const Mesh& mesh, std::span<const std::uint32_t> same_as) {
  std::vector<Edge> all;
  all.reserve(mesh.corner_vertices.size());
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    const std::uint32_t first = mesh.polygon_start[p], last = mesh.polygon_start[p + 1];
    for (std::uint32_t c = first; c < last; ++c) {
      const std::uint32_t a = same_as[mesh.corner_vertices[c]];
      const std::uint32_t b = same_as[mesh.corner_vertices[c + 1 < last ? c + 1 : first]];
      if (a != b) all.push_back(std::minmax(a, b));
    }
  }
  std::sort(all.begin(), all.end());
  std::vector<Edge> open;
  for (std::size_t i = 0; i < all.size();) {
    std::size_t j = i + 1;
    while (j < all.size() && all[j] == all[i]) ++j;
    if (j == i + 1) open.push_back(all[i]);
    i = j;
  }
  return open;
}

// A number for each connected piece, per vertex that stands for itself.
std::vector<std::uint32_t> pieces(const Mesh& mesh, std::span<const std::uint32_t> same_as) {
  std::vector<std::uint32_t> parent(same_as.begin(), same_as.end());
  const auto root = [&parent](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    const std::uint32_t first = root(mesh.corner_vertices[mesh.polygon_start[p]]);
    for (std::uint32_t c = mesh.polygon_start[p] + 1; c < mesh.polygon_start[p + 1]; ++c)
      parent[root(mesh.corner_vertices[c])] = first;
  }
  for (std::uint32_t v = 0; v < parent.size(); ++v) parent[v] = root(v);
  return parent;
}

}  // namespace

std::vector<TVertex> findTVertices(const Mesh& mesh, std::span<const std::uint32_t> same_as, std::span<const Slit> slits) {
  const std::vector<Edge> edges = openEdges(mesh, same_as);
  std::vector<std::pair<double, std::uint32_t>> by_x;
  for (const auto& [a, b] : edges)
    for (const std::uint32_t v : {a, b}) by_x.emplace_back(mesh.positions(v, 0), v);
  std::sort(by_x.begin(), by_x.end());
  by_x.erase(std::unique(by_x.begin(), by_x.end()), by_x.end());
  const double tolerance = 1e-5 * (mesh.positions.colwise().maxCoeff() - mesh.positions.colwise().minCoeff()).norm();
  const std::vector<std::uint32_t> piece = pieces(mesh, same_as);
  std::vector<TVertex> found;
  for (const auto& [a, b] : edges) {
    const Eigen::Vector3d from = mesh.positions.row(a), along = mesh.positions.row(b).transpose() - from;
    const double length2 = along.squaredNorm();
    if (!(length2 > 16 * tolerance * tolerance)) continue;
    const auto [low, high] = std::minmax(mesh.positions(a, 0), mesh.positions(b, 0));
    bool beside_slit = false, asked = false;
    for (auto at = std::lower_bound(by_x.begin(), by_x.end(), std::pair{low - tolerance, 0U});
         at != by_x.end() && at->first <= high + tolerance; ++at) {
      const std::uint32_t v = at->second;
      if (v == a || v == b || piece[v] != piece[a]) continue;  // a lash that touches a lid is no part of it
      const Eigen::Vector3d to = mesh.positions.row(v).transpose() - from;
      const double share = to.dot(along) / length2;
      const double margin = 2 * tolerance / std::sqrt(length2);
      if (share < margin || share > 1 - margin || (to - share * along).norm() > tolerance) continue;
      if (!asked) {
        asked = true;
        beside_slit = runsAlongSlit(slits, from, from + along);
      }
      if (!beside_slit) found.push_back({v, a, b, share});
    }
  }
  std::sort(found.begin(), found.end(), [](const TVertex& x, const TVertex& y) {
    return std::tie(x.a, x.b, x.share, x.vertex) < std::tie(y.a, y.b, y.share, y.vertex);
  });
  return found;
}

Mesh joinTVertices(const Mesh& mesh, std::span<const std::uint32_t> same_as, std::span<const TVertex> found) {
  Mesh out;
  out.polygon_start.push_back(0);
  const auto before = [](const TVertex& t, const Edge& e) { return std::tie(t.a, t.b) < std::tie(e.first, e.second); };
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    const std::uint32_t first = mesh.polygon_start[p], last = mesh.polygon_start[p + 1];
    for (std::uint32_t c = first; c < last; ++c) {
      const std::uint32_t a = same_as[mesh.corner_vertices[c]];
      const std::uint32_t b = same_as[mesh.corner_vertices[c + 1 < last ? c + 1 : first]];
      out.corner_vertices.push_back(mesh.corner_vertices[c]);
      const Edge edge = std::minmax(a, b);
      const auto begin = std::lower_bound(found.begin(), found.end(), edge, before);
      auto end = begin;
      while (end != found.end() && end->a == edge.first && end->b == edge.second) ++end;
      if (a == edge.first)
        for (auto t = begin; t != end; ++t) out.corner_vertices.push_back(t->vertex);
      else
        for (auto t = end; t != begin;) out.corner_vertices.push_back((--t)->vertex);
    }
    out.polygon_start.push_back(static_cast<std::uint32_t>(out.corner_vertices.size()));
  }
  return out;
}

}  // namespace volto::rig
