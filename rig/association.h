// Which triangle of the control mask each vertex of the skin belongs to (Queiroz, section IV-B.2).
#pragma once

#include <array>
#include <vector>

#include "rig/mask_geometry.h"
#include "rig/rig.h"
#include "rig/skin.h"
#include "rig/skin_equations.h"

namespace volto::rig {

using SkinPoints = std::vector<SkinPoint>;  // 84

// Where along an edge skin that the mask covers ends: what is one surface does not end at a vertex of it.
struct SkinBorder {
  std::uint32_t inside, outside;  // on the mask; its neighbour that is not, or is on another side of a slit
  double extent;                  // of the edge, from `inside`
  float length;                   // of the edge

  float left() const { return static_cast<float>(1 - extent) * length; }
};

struct SkinAssociation {
  std::vector<std::int16_t> triangle;  // #V, -1: none
  std::vector<AssociationKind> kind;   // #V; outside for all that is not skin
  std::vector<bool> on_mask;           // #V: associated by its ray, or so close to the mask that it needs none
  std::vector<std::array<double, 3>>
      barycentric;             // #V: where in its triangle; the nearest feature point for `geodesic`
  std::vector<SlitSide> side;  // #V: which lip or lid the vertex is on
  std::vector<float> beyond;   // #V: geodesic distance to the nearest skin on the mask; 0 there
  std::vector<SkinBorder> borders;
  Eigen::Matrix<float, Eigen::Dynamic, static_cast<int>(kFeaturePointCount), Eigen::RowMajor>
      point_distance;  // geodesic; kUnreached when farther away than the point has any say
  float fade_out = 0;  // beyond that the skin stays
  float reach = 0;     // the largest of the distances up to which point_distance is known for all points
};

// `is_skin`: per component. `mask`: of 84 points (controlMaskGeometry). Distances are in the mesh's unit;
// `eye_separation` is what they are measured against: a ray is believed up to 0.4 of it, and only where the way along
// the skin to the triangle's points is not much longer than the way through the air. Vertices up to `fade_out` beyond
// the mask are associated by geodesic path, those farther away with nothing.
SkinAssociation associateSkin(const Mesh& mesh, const Skin& skin, const std::vector<bool>& is_skin,
                              const MaskGeometry& mask, const SkinPoints& on_skin, double eye_separation,
                              double fade_out);

}  // namespace volto::rig
