// A head frame placed in a mesh's frame.
#pragma once

#include <Eigen/Core>

namespace volto::rig {

// p_mesh = origin + size * mesh_from_head * p_head; head frame in eye separations, origin between the eyes.
struct FaceFrame {
  Eigen::Matrix3d mesh_from_head = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double size = 1;  // the eye separation, mesh unit

  Eigen::Vector3d toMesh(const Eigen::Vector3d& p_head) const { return origin + size * (mesh_from_head * p_head); }
  Eigen::Vector3d toHead(const Eigen::Vector3d& p_mesh) const {
    return mesh_from_head.transpose() * (p_mesh - origin) / size;
  }
};

}  // namespace volto::rig
