// The control mask: 136 triangles over the 84 feature points, a disk with three holes (two eyes, mouth).
// Queiroz, Braun, Musse, section IV-A; the triangulation is Volto's own.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "rig/feature_points.h"

namespace volto::rig {

inline constexpr std::size_t kMaskTriangleCount = 136;
using MaskTriangle = std::array<std::uint8_t, 3>;  // feature point indices, counter-clockwise seen from in front of the face

std::span<const MaskTriangle, kMaskTriangleCount> maskTriangles();

// Which region a triangle belongs to (Queiroz, Figure 5 b): lips and lids are labelled so that no region of influence crosses
// the gap between them.
FaceRegion maskTriangleRegion(std::size_t triangle);

// Boundary loops, feature point indices in order along the boundary.
struct MaskLoops {
  std::array<std::uint8_t, 12> outline;
  std::array<std::uint8_t, 8> left_eye, right_eye, mouth;
};
const MaskLoops& maskLoops();

// A neutral mask with human proportions: 84 by 3, millimetres, head frame (+x subject's left, +y up, +z out of the face),
// exactly mirror symmetric, origin between the eyes. For drawing, for priors, and where no face has been measured yet.
const FeaturePointPositions& referenceMask();

}  // namespace volto::rig
