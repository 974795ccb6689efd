// A control mask that was subdivided on its head: what drives the mesh when the driving data is denser than 84 points
// (example meshes, scans). Live frames need none of it: their operator has 84 columns (rig/rig.h).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "rig/feature_points.h"
#include "rig/mesh.h"
#include "rig/sparse_rows.h"

namespace volto::rig {

// #M points, #T triangles, on a mesh of #V vertices.
struct RefinedMask {
  VertexPositions positions;         // #M by 3, mesh frame; the first 84 are the feature points, in their order
  std::vector<std::int32_t> vertex;  // #M: the mesh's vertex at each point; -1 for a feature point at a free position
  std::vector<std::array<std::uint16_t, 3>> triangles;  // #T, seen from in front counter-clockwise
  std::vector<std::uint8_t> base_triangle;              // #T: the triangle of the control mask that it is a part of
  SparseRows to_vertices;          // #V rows over #M points: vertex displacement = row x point displacements
  SparseRows from_feature_points;  // #M rows over 84: the points' displacement when only the feature points' is known

  bool empty() const { return vertex.empty(); }
  std::size_t pointCount() const { return vertex.size(); }
};

inline constexpr std::size_t kMaxRefinedPoints = 8192;

// #V by 3. `point_displacement`: #M by 3. Both in the mesh's frame and unit. Throws std::invalid_argument when the number of rows
// is another.
VertexPositions displaceVertices(const RefinedMask& mask, const VertexPositions& point_displacement);

// #M by 3: where the points of the refined mask go when the 84 feature points go as said and nothing more is known: smoothly
// between them. The first 84 rows are the displacement given.
VertexPositions refineDisplacement(const RefinedMask& mask, const FeaturePointPositions& displacement);

// #M by 3: the displacement of the mask's points on a mesh of the same topology whose vertices moved. `vertices`: #V by 3
// displacements. A feature point at a free position moves as the operator of 84 columns has it nearest: it takes the vertex nearest to it.
VertexPositions pointDisplacements(const RefinedMask& mask, const VertexPositions& neutral,
                                   const VertexPositions& vertices);

}  // namespace volto::rig
