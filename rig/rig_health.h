// How sound a rig is, from the rig alone. What its expressions do to triangles, lids and lips:
// retarget/expression_health.h.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "rig/rig.h"

namespace volto::rig {

struct RegionHealth {
  std::size_t vertices = 0;        // associated with the triangle
  std::size_t control_points = 0;  // of its RBF
  double condition = 0;            // of its RBF's linear system (rig/multiquadric.h)
};

// How much a displacement field jumps where neighbouring vertices belong to different triangles of the mask: at the
// middle of each edge across a border, the difference of what the two sides say there, each extrapolated linearly from
// vertices of its own side alone. Zero for a field that is linear across the border; a smooth one leaves about the square of
// the edge length, so a finer mesh shows less of it and all of a true jump. Root mean square over the edges whose two
// sides have enough vertices to say anything.
struct BorderJump {
  double jump = 0;          // mesh unit
  double displacement = 0;  // there
  std::size_t edges = 0;

  double relative() const { return displacement > 0 ? jump / displacement : 0.0; }
};
// `displacement`: #V by 3. `triangle`: #V, -1 where a vertex counts for neither side.
BorderJump borderJump(const Mesh& mesh, const std::vector<std::int16_t>& triangle, const VertexPositions& displacement);

struct RigHealth {
  std::array<std::size_t, 4> vertices{};  // by AssociationKind
  // Vertices of the skin that stay where they are although a neighbour follows the mask by more than a third: a tear.
  std::vector<std::uint32_t> torn;
  // Vertices whose neighbour, nearer than the mask is fine, was associated with a triangle that has no point in common with theirs.
  std::vector<std::uint32_t> doubtful;
  std::array<RegionHealth, kMaskTriangleCount> regions;
  std::size_t worst_condition = 0;        // triangle
  std::vector<std::uint8_t> empty_regions;  // triangles without any vertex
  std::vector<std::string> shared_points;  // "2.2 2.3": sides of a mouth or eye that are one vertex and cannot part
  BorderJump smoothness;                  // over the expressions
  std::vector<std::string> problems;      // one sentence each, for people
};

RigHealth inspectRig(const Rig& rig);

}  // namespace volto::rig
