// T-vertices: a vertex that lies in the middle of another polygon's edge. Nothing joins the two, and a crack opens when
// the skin moves.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rig/mesh.h"
#include "rig/weld.h"

namespace volto::rig {

struct TVertex {
  std::uint32_t vertex;
  std::uint32_t a, b;  // the edge's ends
  double share;        // of b: the vertex lies at (1 - share) a + share b
};

// Among the vertices that stand for themselves (rig/weld.h), on edges of the same connected piece that only one polygon
// has, except along slits; within 1e-5 of the mesh's size. Ascending by edge and share.
std::vector<TVertex> findTVertices(const Mesh& mesh, std::span<const std::uint32_t> same_as, std::span<const Slit> slits);

// The mesh whose polygons have these vertices as corners of their own: the same surface, joined. Positions, texture
// coordinates and materials are left out.
Mesh joinTVertices(const Mesh& mesh, std::span<const std::uint32_t> same_as, std::span<const TVertex> found);

}  // namespace volto::rig
