// Places on a mesh's surface, and what of a head is skin: the small things that every file here needs.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "rig/rig.h"

namespace volto::transfer {

// A place on a mesh: barycentric in a triangle of its vertices.
struct SurfacePoint {
  std::array<std::uint32_t, 3> vertex{};
  std::array<double, 3> weight{};  // sum 1; all zero: no place
};

bool isNone(const SurfacePoint& p);

// Where it is when the vertices are at `positions` (#V by 3); the origin for none.
Eigen::Vector3d at(const rig::VertexPositions& positions, const SurfacePoint& p);
// The same for a point of a lip's or a lid's margin.
Eigen::Vector3d at(const rig::VertexPositions& positions, const rig::SlitContact::Sample& s);

// Unit, by the order of its vertices; zero for a triangle without area.
Eigen::Vector3d normalOf(const rig::VertexPositions& positions, const std::array<std::uint32_t, 3>& triangle);

// The triangles of what is no separate part (eyeballs, teeth, lashes, hair). `index`: of each in rig::triangulate.
struct SkinTriangles {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::int32_t> index;
};
SkinTriangles skinTriangles(const rig::Rig& rig);

}  // namespace volto::transfer
