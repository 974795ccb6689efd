#include "rig/multiquadric.h"

#include <cmath>
#include <limits>

#include <Eigen/LU>
#include <Eigen/QR>

namespace volto::rig {

Multiquadric::Multiquadric(const VertexPositions& positions, std::span<const std::uint16_t> points, double stiffness)
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
    stiffness2_[j] = nearest2 * stiffness * stiffness;
  }
  const Eigen::MatrixXd matrix = system();
  // Rank revealing where the quick way fails, so that control points at one place give the solution of least norm
  // instead of an infinite one.
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(n + 1, n);
  const Eigen::PartialPivLU<Eigen::MatrixXd> quick(matrix);
  if (quick.rcond() > 1e-11)
    solution_ = quick.solve(identity);
  else
    solution_ = Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(matrix).solve(identity);
}

Eigen::MatrixXd Multiquadric::system() const {
  const Eigen::Index n = centres_.rows();
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n + 1, n + 1);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      matrix(i, j) = std::sqrt((centres_.row(i) - centres_.row(j)).squaredNorm() + stiffness2_[j]);
  matrix.col(n).head(n).setConstant(1.0);
  matrix.row(n).head(n).setConstant(1.0);
  return matrix;
}

double Multiquadric::condition() const {
  if (centres_.rows() == 0) return 1;
  // In units of the points' own spacing: the system has no unit of length of its own.
  Eigen::MatrixXd matrix = system();
  const Eigen::Index n = centres_.rows();
  const double scale = matrix.topLeftCorner(n, n).mean();
  if (scale > 0) matrix.topLeftCorner(n, n) /= scale;
  const double reciprocal = Eigen::PartialPivLU<Eigen::MatrixXd>(matrix).rcond();
  return reciprocal > 1e-16 ? 1 / reciprocal : std::numeric_limits<double>::infinity();
}

void Multiquadric::weightsAt(const Eigen::Vector3d& at, Eigen::RowVectorXd& out) const {
  const Eigen::Index n = centres_.rows();
  Eigen::RowVectorXd basis(n + 1);
  for (Eigen::Index j = 0; j < n; ++j)
    basis[j] = std::sqrt((centres_.row(j).transpose() - at).squaredNorm() + stiffness2_[j]);
  basis[n] = 1.0;
  out.resize(n);
  out.noalias() = basis * solution_;
}

}  // namespace volto::rig
