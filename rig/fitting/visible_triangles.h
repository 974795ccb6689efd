// Which part of a head is seen from outside: not the mouth's bag, the linings of nose and lids, the back of a shell.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "rig/mesh.h"

namespace volto::rig {

// Positions in a head's frame, unit: the eye separation. Looks from 15 directions in front of the face; a triangle is
// seen when a corner or its middle is, and its front side with it. Only what is within 3 eye separations of the origin
// is looked at; what lies beyond counts as not seen. Some 0.1 s for 50 000 triangles.
std::vector<bool> visibleTriangles(const VertexPositions& positions,
                                   const std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace volto::rig
