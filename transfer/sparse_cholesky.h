// A symmetric positive definite sparse system, factored once and solved for many right-hand sides at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/SparseCore>

namespace volto::transfer {

// A = P^T L L^T P. The factor is kept in compressed columns and applied to panels of right-hand sides, so that it is
// read from memory once per panel rather than once per column. Copies nothing of the matrix it was made from; const
// calls from several threads are fine.
class SparseCholesky {
 public:
  // Right-hand sides that are solved together: a panel is #rows by kPanel, row by row.
  static constexpr std::size_t kPanel = 24;

  // The lower triangle of `matrix` is read. Throws std::invalid_argument when it is not square or not positive
  // definite.
  explicit SparseCholesky(const Eigen::SparseMatrix<double>& matrix);

  std::size_t size() const { return order_.size(); }
  std::size_t factorEntries() const { return values_.size(); }

  // Replaces the right-hand sides by the solutions. `panel` has size() * kPanel numbers, `scratch` grows to as many.
  void solve(std::span<double> panel, std::vector<double>& scratch) const;

 private:
  std::vector<std::int32_t> order_;                // row i of the factor is row order_[i] of the matrix
  std::vector<std::int32_t> column_start_, rows_;  // strictly below the diagonal
  std::vector<double> values_;
  std::vector<double> inverse_diagonal_;
};

}  // namespace volto::transfer
