#include "rig/refined_mask.h"

#include <stdexcept>

#include "rig/closest_point.h"

namespace volto::rig {
namespace {

template <class Points>
VertexPositions multiply(const SparseRows& rows, const Points& points) {
  VertexPositions out = VertexPositions::Zero(static_cast<Eigen::Index>(rows.size()), 3);
  for (std::size_t r = 0; r < rows.size(); ++r)
    for (std::size_t e = rows.start[r]; e < rows.start[r + 1]; ++e)
      out.row(static_cast<Eigen::Index>(r)) += rows.weight[e] * points.row(rows.point[e]);
  return out;
}

}  // namespace

VertexPositions displaceVertices(const RefinedMask& mask, const VertexPositions& point_displacement) {
  if (static_cast<std::size_t>(point_displacement.rows()) != mask.pointCount())
    throw std::invalid_argument("the refined mask has " + std::to_string(mask.pointCount()) + " points, given were " +
                                std::to_string(point_displacement.rows()) + " displacements");
  return multiply(mask.to_vertices, point_displacement);
}

VertexPositions refineDisplacement(const RefinedMask& mask, const FeaturePointPositions& displacement) {
  return multiply(mask.from_feature_points, displacement);
}

VertexPositions pointDisplacements(const RefinedMask& mask, const VertexPositions& neutral,
                                   const VertexPositions& vertices) {
  if (neutral.rows() != vertices.rows() || mask.to_vertices.size() != static_cast<std::size_t>(neutral.rows()))
    throw std::invalid_argument("displacements of " + std::to_string(vertices.rows()) +
                                " vertices do not fit the mask's mesh of " +
                                std::to_string(mask.to_vertices.size()) + " vertices");
  VertexPositions out(static_cast<Eigen::Index>(mask.pointCount()), 3);
  for (std::size_t p = 0; p < mask.pointCount(); ++p) {
    Eigen::Index v = mask.vertex[p];
    if (v < 0) v = nearestVertex(neutral, mask.positions.row(static_cast<Eigen::Index>(p)));
    out.row(static_cast<Eigen::Index>(p)) = vertices.row(v);
  }
  return out;
}

}  // namespace volto::rig
