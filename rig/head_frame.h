// The head frame of a face, from its feature points: +x to the subject's left, +y up, +z out of the face.
#pragma once

#include <Eigen/Core>

#include "rig/feature_points.h"

namespace volto::rig {

// Rotation that turns a direction in the head frame into the mesh's frame: d_mesh = mesh_from_head * d_head.
// The best rigid fit (with scale) of the reference mask to the points says it; where that is within 20 degrees of one
// of the 24 rotations that map axes to axes, that one is returned exactly: an artist's upright is more trustworthy than
// an average face's. Positions: mesh frame, any unit. Throws std::invalid_argument for points that are not finite or
// lie in one place or on one line.
Eigen::Matrix3d meshFromHead(const FeaturePointPositions& positions);

}  // namespace volto::rig
