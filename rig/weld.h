// Files split vertices where texture coordinates are cut: the skin must not come apart there.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "rig/mesh.h"

namespace volto::rig {

// Two chains of points that meet at their ends and may touch, but whose sides are not the same skin: closed lips,
// closed lids.
struct Slit {
  std::vector<Eigen::Vector3d> upper, lower;  // from one corner to the other, mesh frame
};

// Whether an edge runs along one of them, close to both of its chains and parallel to them.
bool runsAlongSlit(std::span<const Slit> slits, const Eigen::Vector3d& a, const Eigen::Vector3d& b);

// same_as[v]: the vertex (the smallest index) that stands for v. Vertices are the same when boundary edges of two
// polygons run between the same two positions (within 1e-6 of the mesh's size) - except along a slit, where the edges
// are close to both of its chains and parallel to them.
std::vector<std::uint32_t> weldSeams(const Mesh& mesh, std::span<const Slit> slits);

}  // namespace volto::rig
