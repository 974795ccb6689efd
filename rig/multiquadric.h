// Multiquadric interpolation of displacements with Eck's stiffness (Queiroz, equations 3 to 5), solved once: the
// displacement anywhere is a fixed combination of the displacements of the control points.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "rig/feature_points.h"

namespace volto::rig {

// One triangle's RBF. h_ij = sqrt(|s_j - s_i|^2 + sc_j^2), sc_j = distance of s_j to its nearest control point (Eck). A
// constant is added, with weights that sum to zero: a mere multiquadric does not reproduce a displacement that all
// points share, and grows without bound away from them.
class Multiquadric {
 public:
  Multiquadric() = default;
  // `points` index the rows of `positions`. Control points at one place share their weight (least norm); never
  // singular.
  Multiquadric(const FeaturePointPositions& positions, std::span<const std::uint8_t> points);

  // Adds `scale` times the weights of the control points at `at` to out (84 entries). The weights sum to 1, and are 1
  // and 0 at the control points.
  void addWeights(const Eigen::Vector3d& at, double scale, std::span<double, kFeaturePointCount> out) const;

 private:
  std::vector<std::uint8_t> points_;
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> centres_;
  Eigen::VectorXd stiffness2_;
  Eigen::MatrixXd solution_;  // (n + 1) by n: basis values times this are the weights
};

}  // namespace volto::rig
