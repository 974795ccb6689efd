// What a rig is compared with: one radial basis function over all points of the face at once, no regions, no surface.
#pragma once

#include "rig/mesh.h"

namespace volto::rig {

// Displacement of `at` (#V by 3): #V by C, when `points` (#M by 3, all different) are displaced by `displacement` (#M
// by C). Multiquadric with Eck's stiffness (Queiroz, equations 3 to 5) over all points.
Eigen::MatrixXd globalMultiquadric(const VertexPositions& points, const Eigen::MatrixXd& displacement,
                                   const VertexPositions& at);
// Thin-plate spline in space: |r| and an affine part.
Eigen::MatrixXd globalThinPlate(const VertexPositions& points, const Eigen::MatrixXd& displacement,
                                const VertexPositions& at);

}  // namespace volto::rig
