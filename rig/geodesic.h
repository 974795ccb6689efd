// Shortest paths along the edges of a mesh, measured in length (Queiroz, section IV-B.2, counts edges and asks for
// something better).
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "rig/mesh.h"

namespace volto::rig {

inline constexpr float kUnreached = std::numeric_limits<float>::infinity();

// Compressed rows: the neighbours of vertex v are neighbour[start[v]] .. neighbour[start[v + 1] - 1], ascending.
struct EdgeGraph {
  std::vector<std::uint32_t> start;
  std::vector<std::uint32_t> neighbour;
  std::vector<float> length;

  std::size_t vertexCount() const { return start.empty() ? 0 : start.size() - 1; }
};

inline constexpr std::uint32_t kMostCornersCutAllWays = 8;

// Edges and diagonals of `polygons` (its vertices are the mesh's; of polygons with more than eight corners only the
// diagonals of a fan), between the vertices that `same_as` says stand for others (rig/weld.h); the rest has none.
EdgeGraph buildEdgeGraph(const Mesh& mesh, const Mesh& polygons, std::span<const std::uint32_t> same_as);

struct GeodesicSource {
  std::uint32_t vertex;
  float distance;  // already travelled there
};

struct GeodesicDistances {
  std::vector<float> distance;               // #V; kUnreached beyond the limit and in other components
  std::vector<std::int32_t> nearest_source;  // #V: index into the sources, -1 where unreached
};

// Dijkstra from all sources at once, up to `limit`. O(E log V) of what is reached. Ties go to the earlier source.
GeodesicDistances geodesicDistances(const EdgeGraph& graph, std::span<const GeodesicSource> sources,
                                    float limit = kUnreached);

// The same across the triangles of the surface too, not along their edges alone: where two corners of a triangle are
// known, a straight front passes over it to the third (Kimmel and Sethian, "Computing geodesic paths on manifolds").
// What comes out hardly depends on how the surface is cut into triangles; several times slower. Good for regions as
// sources; near a single one the front is rounder than that, and distances come out a little long.
GeodesicDistances surfaceDistances(const EdgeGraph& graph, std::span<const GeodesicSource> sources,
                                   float limit = kUnreached);

}  // namespace volto::rig
