// Where the points of a refined control mask lie in the mask itself, whatever head it is on: the same place on two
// heads is the same place of the face, however each of them was subdivided.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "rig/refined_mask.h"
#include "rig/rig.h"

namespace volto::transfer {

// A place in a triangle of the control mask.
struct MaskPlace {
  std::uint8_t triangle = 0;            // of the control mask
  std::array<double, 3> barycentric{};  // in the order of its corners; sum 1
};

// The rig's refined mask; where it has none, its 84 feature points as one: to_vertices is the rig's own operator.
rig::RefinedMask drivingMask(const rig::Rig& rig);

// One per point. A point that subdivision added lies at the mean of the three it was put between, as if every split
// were at the centroid. Throws std::invalid_argument when the triangles are no such subdivision.
std::vector<MaskPlace> placesOf(const rig::RefinedMask& mask);

// Values at the points of a mask, at any place: linear in the triangle that the place lies in.
class MaskInterpolation {
 public:
  explicit MaskInterpolation(const rig::RefinedMask& mask);

  struct Row {
    std::array<std::uint16_t, 3> point{};
    std::array<double, 3> weight{};  // sum 1
  };
  Row at(const MaskPlace& place) const;

 private:
  struct Piece {
    std::array<std::uint16_t, 3> point;
    std::array<std::array<double, 3>, 3> corner;  // barycentric in the control mask's triangle
  };
  std::array<std::vector<Piece>, rig::kMaskTriangleCount> pieces_;
};

}  // namespace volto::transfer
