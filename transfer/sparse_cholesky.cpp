#include "transfer/sparse_cholesky.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/SparseCholesky>

namespace volto::transfer {
namespace {

constexpr std::size_t kWidth = SparseCholesky::kPanel;

struct FactorView {
  std::size_t size;
  const std::int32_t* column_start;
  const std::int32_t* rows;
  const double* values;
  const double* inverse_diagonal;
};

// The two triangular solves. Compiled for the instruction sets of the machines at hand; products are never fused with
// sums
// (-ffp-contract=off), so that all of them give the same bits.
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
__attribute__((target_clones("arch=haswell", "default")))
#endif
void solveTriangles(const FactorView& l, double* __restrict x) {
  for (std::size_t j = 0; j < l.size; ++j) {
    double* const xj = x + j * kWidth;
    double moved = 0;  // expressions are local: most rows of a right-hand side are zero
    for (std::size_t k = 0; k < kWidth; ++k) moved += std::abs(xj[k] *= l.inverse_diagonal[j]);
    if (moved == 0) continue;
    for (std::int32_t e = l.column_start[j]; e < l.column_start[j + 1]; ++e) {
      double* const xi = x + static_cast<std::size_t>(l.rows[e]) * kWidth;
      const double value = l.values[e];
      for (std::size_t k = 0; k < kWidth; ++k) xi[k] -= value * xj[k];
    }
  }
  for (std::size_t j = l.size; j-- > 0;) {
    double sum[kWidth];
    double* const xj = x + j * kWidth;
    for (std::size_t k = 0; k < kWidth; ++k) sum[k] = xj[k];
    for (std::int32_t e = l.column_start[j]; e < l.column_start[j + 1]; ++e) {
      const double* const xi = x + static_cast<std::size_t>(l.rows[e]) * kWidth;
      const double value = l.values[e];
      for (std::size_t k = 0; k < kWidth; ++k) sum[k] -= value * xi[k];
    }
    for (std::size_t k = 0; k < kWidth; ++k) xj[k] = sum[k] * l.inverse_diagonal[j];
  }
}

}  // namespace

SparseCholesky::SparseCholesky(const Eigen::SparseMatrix<double>& matrix) {
  if (matrix.rows() != matrix.cols()) throw std::invalid_argument("SparseCholesky: the matrix is not square");
  const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor(matrix);
  if (factor.info() != Eigen::Success)
    throw std::invalid_argument("SparseCholesky: the matrix is not positive definite");
  const auto& l = factor.matrixL().nestedExpression();
  const auto size = static_cast<std::size_t>(l.cols());
  order_.resize(size);
  for (std::size_t i = 0; i < size; ++i) {
    // Without a permutation (a matrix of no or one row) Eigen keeps none.
    order_[i] = factor.permutationPinv().size() == 0
                    ? static_cast<std::int32_t>(i)
                    : static_cast<std::int32_t>(factor.permutationPinv().indices()[static_cast<Eigen::Index>(i)]);
  }
  column_start_.push_back(0);
  inverse_diagonal_.resize(size);
  rows_.reserve(static_cast<std::size_t>(l.nonZeros()));
  values_.reserve(static_cast<std::size_t>(l.nonZeros()));
  for (Eigen::Index j = 0; j < l.cols(); ++j) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(l, j); it; ++it) {
      if (it.row() == j) {
        inverse_diagonal_[static_cast<std::size_t>(j)] = 1.0 / it.value();
      } else if (it.row() > j) {
        rows_.push_back(static_cast<std::int32_t>(it.row()));
        values_.push_back(it.value());
      }
    }
    column_start_.push_back(static_cast<std::int32_t>(rows_.size()));
  }
}

void SparseCholesky::solve(std::span<double> panel, std::vector<double>& scratch) const {
  if (panel.size() != size() * kPanel) throw std::invalid_argument("SparseCholesky: a panel of another size");
  scratch.resize(panel.size());
  for (std::size_t i = 0; i < size(); ++i)
    std::copy_n(panel.data() + static_cast<std::size_t>(order_[i]) * kPanel, kPanel, scratch.data() + i * kPanel);
  solveTriangles({size(), column_start_.data(), rows_.data(), values_.data(), inverse_diagonal_.data()},
                 scratch.data());
  for (std::size_t i = 0; i < size(); ++i)
    std::copy_n(scratch.data() + i * kPanel, kPanel, panel.data() + static_cast<std::size_t>(order_[i]) * kPanel);
}

}  // namespace volto::transfer
