#include "rig/head_frame.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "rig/control_mask.h"

namespace volto::rig {
namespace {

constexpr double kSnapAngle_rad = 20.0 * std::numbers::pi / 180.0;

// The proper rotation with one entry of +-1 in each row and column that is nearest to R (largest trace of A^T R).
Eigen::Matrix3d nearestAxisRotation(const Eigen::Matrix3d& rotation) {
  Eigen::Matrix3d best = Eigen::Matrix3d::Identity();
  double best_trace = -4;
  constexpr int kPermutations[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (const auto& permutation : kPermutations)
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d candidate = Eigen::Matrix3d::Zero();
      for (int i = 0; i < 3; ++i) candidate(permutation[i], i) = (signs >> i) & 1 ? -1 : 1;
      if (candidate.determinant() < 0) continue;
      const double trace = (candidate.transpose() * rotation).trace();
      if (trace > best_trace) {
        best_trace = trace;
        best = candidate;
      }
    }
  return best;
}

}  // namespace

Eigen::Matrix3d meshFromHead(const FeaturePointPositions& positions) {
  if (!positions.allFinite()) throw std::invalid_argument("a feature point is not a finite position");
  const FeaturePointPositions& reference = referenceMask();
  const Eigen::Matrix<double, Eigen::Dynamic, 3> from = reference.rowwise() - reference.colwise().mean();
  const Eigen::Matrix<double, Eigen::Dynamic, 3> to = positions.rowwise() - positions.colwise().mean();
  const Eigen::Matrix3d covariance = to.transpose() * from;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (!(svd.singularValues()(1) > 1e-9 * svd.singularValues()(0)) || svd.singularValues()(0) <= 0)
    throw std::invalid_argument("the feature points lie in one place or on one line: no face can be seen in them");
  Eigen::Vector3d sign(1, 1, 1);
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) sign.z() = -1;
  const Eigen::Matrix3d fitted = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();

  const Eigen::Matrix3d snapped = nearestAxisRotation(fitted);
  const double angle = Eigen::AngleAxisd(Eigen::Matrix3d(snapped.transpose() * fitted)).angle();
  return angle <= kSnapAngle_rad ? snapped : fitted;
}

}  // namespace volto::rig
