#include "rig/measure/global_splines.h"

#include <cmath>
#include <limits>

#include <Eigen/LU>

namespace volto::rig {
namespace {

using Matrix = Eigen::MatrixXd;

Matrix distances(const VertexPositions& a, const VertexPositions& b) {
  Matrix out(a.rows(), b.rows());
  for (Eigen::Index j = 0; j < b.rows(); ++j) out.col(j) = (a.rowwise() - b.row(j)).rowwise().norm();
  return out;
}

}  // namespace

Eigen::MatrixXd globalMultiquadric(const VertexPositions& points, const Eigen::MatrixXd& displacement,
                                   const VertexPositions& at) {
  Matrix between = distances(points, points);
  Eigen::RowVectorXd stiffness2(points.rows());
  for (Eigen::Index j = 0; j < points.rows(); ++j) {
    double nearest = std::numeric_limits<double>::infinity();
    for (Eigen::Index i = 0; i < points.rows(); ++i)
      if (i != j) nearest = std::min(nearest, between(i, j));
    stiffness2[j] = nearest * nearest;
  }
  const auto basis = [&](const Matrix& d) -> Matrix {
    return (d.array().square().rowwise() + stiffness2.array()).sqrt();
  };
  const Matrix weights = Eigen::PartialPivLU<Matrix>(basis(between)).solve(displacement);
  return basis(distances(at, points)) * weights;
}

Eigen::MatrixXd globalThinPlate(const VertexPositions& points, const Eigen::MatrixXd& displacement,
                                const VertexPositions& at) {
  const Eigen::Index n = points.rows();
  const auto basis = [&](const VertexPositions& where) -> Matrix {
    Matrix b(where.rows(), n + 4);
    b.leftCols(n) = distances(where, points);
    b.col(n).setOnes();
    b.rightCols(3) = where;
    return b;
  };
  Matrix system = Matrix::Zero(n + 4, n + 4);
  system.topRows(n) = basis(points);
  system.bottomLeftCorner(4, n) = system.topRightCorner(n, 4).transpose();
  Matrix right = Matrix::Zero(n + 4, displacement.cols());
  right.topRows(n) = displacement;
  return basis(at) * Eigen::PartialPivLU<Matrix>(system).solve(right);
}

}  // namespace volto::rig
