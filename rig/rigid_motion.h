// The turn and shift that take some vertices from one place to another best, in the least squares sense (Kabsch 1976).
#pragma once

#include <cstdint>
#include <span>

#include "rig/mesh.h"

namespace volto::rig {

struct RigidMotion {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // of the vertices before
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();   // of that centre
};

// `vertices`: at least one, rows of both. A turn about an axis on which all of them lie is not seen, and none.
RigidMotion bestRigidMotion(std::span<const std::uint32_t> vertices, const VertexPositions& from,
                            const VertexPositions& to);

}  // namespace volto::rig
