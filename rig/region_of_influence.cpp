#include "rig/region_of_influence.h"

#include <algorithm>
#include <string_view>

namespace volto::rig {
namespace {

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

}  // namespace

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

RegionsOfInfluence regionsOfInfluence() {
  RegionsOfInfluence regions;
  const auto triangles = maskTriangles();
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (const std::uint8_t p : triangles[t]) regions.triangles_of_point[p].push_back(static_cast<std::uint8_t>(t));
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const SlitSide side = slitSideOfTriangle(t);
    std::array<bool, kFeaturePointCount> taken{};
    for (const std::uint8_t p : triangles[t])
      for (const std::uint8_t neighbour : regions.triangles_of_point[p])
        for (const std::uint8_t q : triangles[neighbour])
          if (!opposite(side, slitSide(q))) taken[q] = true;
    for (const std::uint8_t p : triangles[t]) taken[p] = true;
    for (std::size_t p = 0; p < kFeaturePointCount; ++p)
      if (taken[p]) regions.points[t].push_back(static_cast<std::uint8_t>(p));
  }
  return regions;
}

}  // namespace volto::rig
