// Which triangle of the control mask each vertex of the skin belongs to (Queiroz, section IV-B.2).
#pragma once

#include <array>
#include <vector>

#include "rig/region_of_influence.h"
#include "rig/rig.h"
#include "rig/skin.h"

namespace volto::rig {

// A feature point on the skin: one vertex, or the three of the triangle it lies in.
struct SkinPoint {
  std::vector<GeodesicSource> around;  // the vertices and how far they are
  std::vector<double> weight;          // barycentric, sum 1
  bool isVertex() const { return around.size() == 1; }
};
using SkinPoints = std::array<SkinPoint, kFeaturePointCount>;

struct SkinAssociation {
  std::vector<std::int16_t> triangle;  // #V, -1: none
  std::vector<AssociationKind> kind;   // #V; outside for all that is not skin
  std::vector<bool> on_mask;           // #V: associated by its ray, or so close to the mask that it needs none
  std::vector<std::array<double, 3>>
      barycentric;             // #V: where in its triangle; the nearest feature point for `geodesic`
  std::vector<SlitSide> side;  // #V: which lip or lid the vertex is on
  std::vector<float> beyond;   // #V: geodesic distance to the nearest vertex on the mask; 0 there
  Eigen::Matrix<float, Eigen::Dynamic, static_cast<int>(kFeaturePointCount), Eigen::RowMajor>
      point_distance;  // geodesic; kUnreached when far
};

// `is_skin`: per component. Distances are in the mesh's unit; `eye_separation` is what they are measured against: a ray
// is believed up to 0.4 of it, and only where the way along the skin to the triangle's points is not much longer than
// the way through the air. Vertices up to `fade_out` beyond the mask are associated by geodesic path, those farther
// away with nothing.
SkinAssociation associateSkin(const Mesh& mesh, const Skin& skin, const std::vector<bool>& is_skin,
                              const FeaturePointPositions& points, const SkinPoints& on_skin, double eye_separation,
                              double fade_out);

}  // namespace volto::rig
