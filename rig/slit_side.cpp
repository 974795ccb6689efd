#include "rig/slit_side.h"

#include <algorithm>
#include <string_view>

namespace volto::rig {

SlitSide sideOf(FaceRegion region) {
  switch (region) {
    case FaceRegion::upper_lip:
      return SlitSide::upper_lip;
    case FaceRegion::lower_lip:
    case FaceRegion::chin:
      return SlitSide::lower_lip;
    case FaceRegion::left_upper_lid:
      return SlitSide::left_upper_lid;
    case FaceRegion::left_lower_lid:
      return SlitSide::left_lower_lid;
    case FaceRegion::right_upper_lid:
      return SlitSide::right_upper_lid;
    case FaceRegion::right_lower_lid:
      return SlitSide::right_lower_lid;
    default:
      return SlitSide::none;
  }
}

SlitSide slitSide(std::size_t feature_point) {
  constexpr std::array<std::string_view, 8> kCorners = {"2.4", "2.5", "8.3", "8.4", "3.7", "3.8", "3.11", "3.12"};
  const FeaturePoint& point = featurePoints()[feature_point];
  if (std::find(kCorners.begin(), kCorners.end(), point.id) != kCorners.end()) return SlitSide::none;
  return sideOf(point.region);
}

SlitSide slitSideOfTriangle(std::size_t mask_triangle) { return sideOf(maskTriangleRegion(mask_triangle)); }

bool opposite(SlitSide a, SlitSide b) {
  const auto is = [a, b](SlitSide x, SlitSide y) { return (a == x && b == y) || (a == y && b == x); };
  return is(SlitSide::upper_lip, SlitSide::lower_lip) || is(SlitSide::left_upper_lid, SlitSide::left_lower_lid) ||
         is(SlitSide::right_upper_lid, SlitSide::right_lower_lid);
}

}  // namespace volto::rig
