// The sides of the slits in the face, from the labels of points and triangles: what keeps the regions of influence of
// one lip or lid from reaching the other (Queiroz, section IV-A, Figure 5 b). The regions themselves: rig/mask_geometry.h.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "rig/control_mask.h"

namespace volto::rig {

// The two sides of a slit that skin must not be pulled across.
enum class SlitSide : std::uint8_t {
  none,
  upper_lip,
  lower_lip,
  left_upper_lid,
  left_lower_lid,
  right_upper_lid,
  right_lower_lid,
};

// Which side a feature point is on. The corners of mouth and eyes (2.4, 2.5, 8.3, 8.4; 3.7, 3.8, 3.11, 3.12) are on
// none: both sides share them. The chin goes with the lower lip.
SlitSide slitSide(std::size_t feature_point);
SlitSide slitSideOfTriangle(std::size_t mask_triangle);

// True for the two sides of the same slit.
bool opposite(SlitSide a, SlitSide b);

SlitSide sideOf(FaceRegion region);

}  // namespace volto::rig
