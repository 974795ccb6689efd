// The control mask as geometry on one head: its 84 points and 136 triangles, or what subdivision (rig/subdivision.h)
// made of them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "rig/mesh.h"
#include "rig/rig_options.h"
#include "rig/slit_side.h"

namespace volto::rig {

struct MaskGeometry {
  using Triangle = std::array<std::uint16_t, 3>;  // indices into points, counter-clockwise seen from in front

  VertexPositions points;                         // #M by 3, mesh frame; the first 84 are the feature points
  std::vector<SlitSide> point_side;               // #M
  std::vector<Triangle> triangles;                // #T
  std::vector<SlitSide> triangle_side;            // #T
  std::vector<std::uint8_t> base_triangle;        // #T: the triangle of the control mask that it is a part of

  std::size_t pointCount() const { return static_cast<std::size_t>(points.rows()); }
};

MaskGeometry controlMaskGeometry(const FeaturePointPositions& points, const RegionEdits& edits = {});

// Control points of the RBF of each triangle of the CONTROL MASK (Queiroz, Figures 3 and 5; section V-A1): its own
// points and those of the triangles that share a point with it, as far as lips and lids and the edits allow, and of the
// points that subdivision added those inside the triangle and in the triangles beside it.
struct RegionsOfInfluence {
  std::array<std::vector<std::uint16_t>, kMaskTriangleCount> points;  // ascending; a triangle's own are always there
  std::vector<std::vector<std::uint8_t>> triangles_of_point;          // #M: whose RBFs hold at that point
};
RegionsOfInfluence regionsOfInfluence(const MaskGeometry& mask, const RegionEdits& edits = {});

}  // namespace volto::rig
