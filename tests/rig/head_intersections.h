// Which triangles of a surface go through each other: every pair, found through a grid, so that nothing is assumed
// about the surface. Used on the shipped heads at rest.
#pragma once

#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "rig/assets/head/vec3.h"

namespace volto::head {

using Triangle = std::array<int, 3>;  // vertex indices

// Pairs (a < b) of triangles with a point in common that is no point of a vertex or edge they share. Triangles that
// share an edge are said to cross when they are folded flat onto each other (less than one degree between them).
// Lengths in the unit of `at`; touching within 1e-9 does not count.
std::vector<std::pair<std::size_t, std::size_t>> crossingTriangles(const std::vector<Vec3>& at,
                                                                   const std::vector<Triangle>& triangles);

}  // namespace volto::head
