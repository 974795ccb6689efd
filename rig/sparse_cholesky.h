// Cholesky factors of a sparse symmetric positive definite matrix, by fronts: the multifrontal method (Duff, Reid,
// 1983; Liu, 1992). Columns whose factors look alike are one dense block, and branches of the elimination tree that
// have nothing to do with each other are the work of different threads. The result does not depend on their number.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

namespace volto::rig {

class SparseCholesky {
 public:
  // `lower`: square, the lower triangle alone. A pivot that rounding has left nothing of (a part of the system that
  // nothing holds) counts as its whole diagonal entry. Throws std::runtime_error where the matrix has a number that is
  // not finite, or a diagonal entry that is not positive.
  explicit SparseCholesky(const Eigen::SparseMatrix<double>& lower);

  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  // `x`: one column per right side, replaced by the solution. Thread-safe.
  void solve(Rows& x) const;

 private:
  // Columns first .. first + columns - 1 of the factors (in elimination order): `rows` names their rows, the columns
  // themselves first, and `factor` holds rows.size() by columns.
  struct Front {
    std::int32_t first = 0, columns = 0;
    std::vector<std::int32_t> rows;
    Eigen::MatrixXd factor;
  };
  struct Plan;

  void analyse(const Eigen::SparseMatrix<double>& lower, Plan& plan);
  void factorFront(const Plan& plan, std::size_t front, std::vector<Eigen::MatrixXd>& updates);

  std::vector<std::int32_t> order_;  // elimination order -> row of the matrix
  std::vector<Front> fronts_;        // children before parents
};

}  // namespace volto::rig
