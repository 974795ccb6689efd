// The same head in another mesh: finer, coarser, in another order. Vertices that both meshes have are known.
#pragma once

#include <cstdint>
#include <vector>

#include "rig/build_rig.h"

namespace volto::test {

struct Remeshed {
  rig::Mesh mesh;
  std::vector<std::int64_t> original;  // per vertex of `mesh`: the vertex of the first mesh at that place, -1: none
};

// Every triangle in four, at the middles of its edges.
Remeshed subdivided(const rig::Mesh& mesh);
// Edges collapsed, those first whose loss changes the surface least (Garland, Heckbert: Surface Simplification Using
// Quadric Error Metrics), until `share` of the vertices is left or nothing can go; vertices of `keep`, of open edges and
// where a triangle would turn over stay. No vertex moves.
Remeshed decimated(const rig::Mesh& mesh, double share, const std::vector<std::uint32_t>& keep);
// Vertices and polygons in another order, the same for the same seed.
Remeshed shuffled(const rig::Mesh& mesh, std::uint32_t seed);

// Feature points of the first mesh on the second; every one must be a vertex that both have.
rig::FeaturePointChoices pointsOn(const Remeshed& remeshed, const rig::FeaturePointChoices& points);

}  // namespace volto::test
