#include "rig/rigid_motion.h"

#include <Eigen/LU>
#include <Eigen/SVD>

namespace volto::rig {

RigidMotion bestRigidMotion(std::span<const std::uint32_t> vertices, const VertexPositions& from,
                            const VertexPositions& to) {
  RigidMotion m;
  Eigen::Vector3d moved = Eigen::Vector3d::Zero();
  const double n = static_cast<double>(vertices.size());
  for (const std::uint32_t v : vertices) {
    m.centre += from.row(v).transpose() / n;
    moved += to.row(v).transpose() / n;
  }
  m.shift = moved - m.centre;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const std::uint32_t v : vertices)
    covariance += (to.row(v).transpose() - moved) * (from.row(v).transpose() - m.centre).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  // Two directions must be seen, or the turn is any.
  if (!(svd.singularValues()[1] > 1e-12 * svd.singularValues()[0])) return m;
  const double side = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  m.rotation = svd.matrixU() * Eigen::Vector3d(1, 1, side).asDiagonal() * svd.matrixV().transpose();
  return m;
}

}  // namespace volto::rig
