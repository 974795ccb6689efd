#include "rig/mask_geometry.h"

#include <algorithm>

namespace volto::rig {
namespace {

// A point that both sides of a slit share: the corners of mouth and eyes. Labels do not change that.
bool isCorner(std::size_t point) {
  return slitSide(point) == SlitSide::none && sideOf(featurePoints()[point].region) != SlitSide::none;
}

}  // namespace

MaskGeometry controlMaskGeometry(const FeaturePointPositions& points, const RegionEdits& edits) {
  MaskGeometry mask;
  mask.points = points;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) mask.point_side.push_back(slitSide(p));
  for (const auto& [p, region] : edits.labels)
    if (!isCorner(p)) mask.point_side[p] = sideOf(region);
  const auto triangles = maskTriangles();
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    mask.triangles.push_back({triangles[t][0], triangles[t][1], triangles[t][2]});
    mask.triangle_side.push_back(slitSideOfTriangle(t));
    mask.base_triangle.push_back(static_cast<std::uint8_t>(t));
  }
  return mask;
}

RegionsOfInfluence regionsOfInfluence(const MaskGeometry& mask, const RegionEdits& edits) {
  const auto triangles = maskTriangles();
  std::array<std::vector<std::uint8_t>, kFeaturePointCount> around;  // triangles of the control mask at each point
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (const std::uint8_t p : triangles[t]) around[p].push_back(static_cast<std::uint8_t>(t));

  // The points that subdivision added, by the triangle they lie in.
  std::array<std::vector<std::uint16_t>, kMaskTriangleCount> inside;
  for (std::size_t leaf = 0; leaf < mask.triangles.size(); ++leaf)
    for (const std::uint16_t p : mask.triangles[leaf])
      if (p >= kFeaturePointCount) inside[mask.base_triangle[leaf]].push_back(p);
  std::array<SlitSide, kMaskTriangleCount> side{};
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    std::sort(inside[t].begin(), inside[t].end());
    inside[t].erase(std::unique(inside[t].begin(), inside[t].end()), inside[t].end());
    side[t] = slitSideOfTriangle(t);
  }

  RegionsOfInfluence regions;
  regions.triangles_of_point.resize(mask.pointCount());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    std::vector<bool> neighbour(kMaskTriangleCount, false);
    std::array<int, kMaskTriangleCount> shared{};  // points in common
    for (const std::uint8_t p : triangles[t])
      for (const std::uint8_t u : around[p]) {
        neighbour[u] = true;
        ++shared[u];
      }
    if (const auto edit = edits.neighbourhoods.find(static_cast<std::uint8_t>(t)); edit != edits.neighbourhoods.end()) {
      for (const std::uint8_t u : edit->second.add) neighbour[u] = true;
      for (const std::uint8_t u : edit->second.remove) neighbour[u] = false;
    }
    neighbour[t] = true;
    std::vector<std::uint16_t>& points = regions.points[t];
    for (std::size_t u = 0; u < triangles.size(); ++u) {
      if (!neighbour[u]) continue;
      for (const std::uint8_t q : triangles[u])
        if (u == t || !opposite(side[t], mask.point_side[q])) points.push_back(q);
      if (u == t || (shared[u] == 2 && !opposite(side[t], side[u])))
        points.insert(points.end(), inside[u].begin(), inside[u].end());
    }
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
  }
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) regions.triangles_of_point[p] = around[p];
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (const std::uint16_t p : inside[t]) regions.triangles_of_point[p].push_back(static_cast<std::uint8_t>(t));
  return regions;
}

}  // namespace volto::rig
