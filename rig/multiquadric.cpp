#include "rig/multiquadric.h"

#include <cmath>

#include <Eigen/QR>

namespace volto::rig {

Multiquadric::Multiquadric(const FeaturePointPositions& positions, std::span<const std::uint8_t> points)
    : points_(points.begin(), points.end()) {
  const auto n = static_cast<Eigen::Index>(points.size());
  centres_.resize(n, 3);
  for (Eigen::Index j = 0; j < n; ++j) centres_.row(j) = positions.row(points[static_cast<std::size_t>(j)]);
  stiffness2_.setZero(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    double nearest2 = 0;
    for (Eigen::Index i = 0; i < n; ++i) {
      const double d2 = (centres_.row(i) - centres_.row(j)).squaredNorm();
      if (i != j && d2 > 0 && (nearest2 == 0 || d2 < nearest2)) nearest2 = d2;
    }
    stiffness2_[j] = nearest2;
  }
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + 1, n + 1);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      system(i, j) = std::sqrt((centres_.row(i) - centres_.row(j)).squaredNorm() + stiffness2_[j]);
  system.col(n).head(n).setConstant(1.0);
  system.row(n).head(n).setConstant(1.0);
  // Rank revealing, so that control points at one place give the solution of least norm instead of an infinite one.
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(system);
  solution_ = solver.solve(Eigen::MatrixXd::Identity(n + 1, n));
}

void Multiquadric::addWeights(const Eigen::Vector3d& at, double scale,
                              std::span<double, kFeaturePointCount> out) const {
  const auto n = static_cast<Eigen::Index>(points_.size());
  Eigen::RowVectorXd basis(n + 1);
  for (Eigen::Index j = 0; j < n; ++j)
    basis[j] = std::sqrt((centres_.row(j).transpose() - at).squaredNorm() + stiffness2_[j]);
  basis[n] = 1.0;
  const Eigen::RowVectorXd weights = basis * solution_;
  for (Eigen::Index j = 0; j < n; ++j) out[points_[static_cast<std::size_t>(j)]] += scale * weights[j];
}

}  // namespace volto::rig
