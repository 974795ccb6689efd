// Multiquadric interpolation of displacements with Eck's stiffness (Queiroz, equations 3 to 5), solved once: the
// displacement anywhere is a fixed combination of the displacements of the control points.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "rig/mesh.h"

namespace volto::rig {

// One triangle's RBF. h_ij = sqrt(|s_j - s_i|^2 + sc_j^2), sc_j = distance of s_j to its nearest control point (Eck),
// times a factor. A constant is added, with weights that sum to zero: a mere multiquadric does not reproduce a
// displacement that all points share, and grows without bound away from them.
class Multiquadric {
 public:
  Multiquadric() = default;
  // `points` index the rows of `positions` (#M by 3). Control points at one place share their weight (least norm);
  // never singular.
  Multiquadric(const VertexPositions& positions, std::span<const std::uint16_t> points, double stiffness = 1.0);

  std::span<const std::uint16_t> points() const { return points_; }

  // Weights of the control points at `at`, parallel to points(). They sum to 1, and are 1 and 0 at the control points.
  // `out` is resized. Thread-safe.
  void weightsAt(const Eigen::Vector3d& at, Eigen::RowVectorXd& out) const;

  // Of the linear system, in the 1-norm, estimated: how much an error in the points' displacements may grow. Infinite
  // when control points are at one place.
  double condition() const;

 private:
  Eigen::MatrixXd system() const;

  std::vector<std::uint16_t> points_;
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> centres_;
  Eigen::VectorXd stiffness2_;
  Eigen::MatrixXd solution_;  // (n + 1) by n: basis values times this are the weights
};

}  // namespace volto::rig
