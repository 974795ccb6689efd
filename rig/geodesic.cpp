#include "rig/geodesic.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <queue>
#include <tuple>

namespace volto::rig {

EdgeGraph buildEdgeGraph(const Mesh& mesh, const Mesh& polygons, std::span<const std::uint32_t> same_as) {
  std::vector<std::array<std::uint32_t, 2>> edges;
  edges.reserve(polygons.corner_vertices.size() * 2);
  const auto connect = [&edges](std::uint32_t a, std::uint32_t b) {
    if (a != b) edges.push_back({a, b});
  };
  for (std::size_t p = 0; p < polygons.polygonCount(); ++p) {
    const std::uint32_t first = polygons.polygon_start[p];
    const std::uint32_t corners = polygons.polygon_start[p + 1] - first;
    const auto corner = [&](std::uint32_t c) { return same_as[polygons.corner_vertices[first + c % corners]]; };
    for (std::uint32_t c = 0; c < corners; ++c) connect(corner(c), corner(c + 1));
    if (corners <= kMostCornersCutAllWays) {
      for (std::uint32_t c = 0; c + 2 < corners; ++c)
        for (std::uint32_t d = c + 2; d < corners; ++d) connect(corner(c), corner(d));
    } else {
      for (std::uint32_t c = 2; c + 1 < corners; ++c) connect(corner(0), corner(c));
    }
  }
  // Each vertex's own, which are few, in order.
  std::vector<std::uint32_t> start(mesh.vertexCount() + 1, 0), both_ways(2 * edges.size());
  for (const auto& edge : edges)
    for (const std::uint32_t v : edge) ++start[v + 1];
  for (std::size_t v = 0; v < mesh.vertexCount(); ++v) start[v + 1] += start[v];
  std::vector<std::uint32_t> filled(start.begin(), start.end() - 1);
  for (const auto& [a, b] : edges) {
    both_ways[filled[a]++] = b;
    both_ways[filled[b]++] = a;
  }
  EdgeGraph graph;
  graph.start.assign(mesh.vertexCount() + 1, 0);
  graph.neighbour.reserve(both_ways.size());
  graph.length.reserve(both_ways.size());
  for (std::uint32_t v = 0; v < mesh.vertexCount(); ++v) {
    const auto first = both_ways.begin() + start[v], last = both_ways.begin() + start[v + 1];
    std::sort(first, last);
    graph.neighbour.insert(graph.neighbour.end(), first, std::unique(first, last));
    for (std::size_t e = graph.length.size(); e < graph.neighbour.size(); ++e)
      graph.length.push_back(
          static_cast<float>((mesh.positions.row(v) - mesh.positions.row(graph.neighbour[e])).norm()));
    graph.start[v + 1] = static_cast<std::uint32_t>(graph.neighbour.size());
  }
  return graph;
}

GeodesicDistances geodesicDistances(const EdgeGraph& graph, std::span<const GeodesicSource> sources, float limit) {
  GeodesicDistances out;
  out.distance.assign(graph.vertexCount(), kUnreached);
  out.nearest_source.assign(graph.vertexCount(), -1);
  // Distances are not negative, so their bits are in their order: one comparison for distance and vertex.
  std::priority_queue<std::uint64_t, std::vector<std::uint64_t>, std::greater<>> queue;
  const auto offer = [&](float distance, std::int32_t source, std::uint32_t v) {
    if (!(distance <= limit) || distance > out.distance[v]) return;
    if (distance == out.distance[v] && source >= out.nearest_source[v]) return;
    out.distance[v] = distance;
    out.nearest_source[v] = source;
    queue.push(std::uint64_t{std::bit_cast<std::uint32_t>(distance)} << 32 | v);
  };
  for (std::size_t s = 0; s < sources.size(); ++s)
    offer(sources[s].distance, static_cast<std::int32_t>(s), sources[s].vertex);
  while (!queue.empty()) {
    const std::uint64_t entry = queue.top();
    queue.pop();
    const auto v = static_cast<std::uint32_t>(entry);
    const auto distance = std::bit_cast<float>(static_cast<std::uint32_t>(entry >> 32));
    if (distance > out.distance[v]) continue;
    for (std::uint32_t e = graph.start[v]; e < graph.start[v + 1]; ++e)
      offer(distance + graph.length[e], out.nearest_source[v], graph.neighbour[e]);
  }
  return out;
}

namespace {

// Distance at the third corner of a triangle from those at the ends of its base, of a front that is straight across the
// triangle (Kimmel and Sethian, "Computing geodesic paths on manifolds"); infinite where it does not come across the
// base. The corner lies `to_a` and `to_b` from the ends, which are `base` apart.
float acrossTriangle(float a, float b, float base, float to_a, float to_b) {
  if (!(base > 0)) return kUnreached;
  const float x = (to_a * to_a - to_b * to_b + base * base) / (2 * base);
  const float y = std::sqrt(std::max(0.0F, to_a * to_a - x * x));
  const float along = (b - a) / base;
  if (!(y > 1e-4F * base) || !(std::abs(along) < 1)) return kUnreached;
  const float onward = std::sqrt(1 - along * along), crossing = x - along / onward * y;
  return crossing >= 0 && crossing <= base ? a + along * x + onward * y : kUnreached;
}

}  // namespace

GeodesicDistances surfaceDistances(const EdgeGraph& graph, std::span<const GeodesicSource> sources, float limit) {
  GeodesicDistances out;
  out.distance.assign(graph.vertexCount(), kUnreached);
  out.nearest_source.assign(graph.vertexCount(), -1);
  std::vector<bool> settled(graph.vertexCount(), false);
  using Entry = std::tuple<float, std::int32_t, std::uint32_t>;  // distance, source, vertex
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  const auto offer = [&](float distance, std::int32_t source, std::uint32_t v) {
    if (!(distance <= limit) || !(distance < out.distance[v])) return;
    out.distance[v] = distance;
    out.nearest_source[v] = source;
    queue.emplace(distance, source, v);
  };
  for (std::size_t s = 0; s < sources.size(); ++s)
    offer(sources[s].distance, static_cast<std::int32_t>(s), sources[s].vertex);
  while (!queue.empty()) {
    const auto [distance, source, v] = queue.top();
    queue.pop();
    if (settled[v] || distance > out.distance[v]) continue;
    settled[v] = true;
    for (std::uint32_t e = graph.start[v]; e < graph.start[v + 1]; ++e) {
      const std::uint32_t u = graph.neighbour[e];
      if (settled[u]) continue;
      offer(distance + graph.length[e], source, u);
      // Triangles of u, v and a third vertex that is settled: neighbours of both, in ascending order in both lists.
      std::uint32_t i = graph.start[v], j = graph.start[u];
      while (i < graph.start[v + 1] && j < graph.start[u + 1]) {
        const std::uint32_t a = graph.neighbour[i], b = graph.neighbour[j];
        if (a == b && settled[a]) {
          const float across = acrossTriangle(distance, out.distance[a], graph.length[i], graph.length[e], graph.length[j]);
          offer(std::max(across, distance), source, u);
        }
        i += a <= b ? 1 : 0;
        j += b <= a ? 1 : 0;
      }
    }
  }
  return out;
}

}  // namespace volto::rig
