#include "rig/sparse_cholesky.h"

#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

namespace volto::rig {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

// Squared Laplacian of a grid, with a little on the diagonal.
Sparse gridSystem(int width, int height, double on_diagonal) {
  const int count = width * height;
  std::vector<Eigen::Triplet<double>> entries;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int v = y * width + x;
      for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        if (x + dx < 0 || x + dx >= width || y + dy < 0 || y + dy >= height) continue;
        entries.emplace_back(v, v + dy * width + dx, 1.0 + 0.1 * ((x * 7 + y * 3 + dx * dx) % 5));
        entries.emplace_back(v, v, -entries.back().value());
      }
    }
  Sparse laplacian(count, count);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  Sparse system = Sparse(laplacian.transpose()) * laplacian;
  for (int v = 0; v < count; ++v) system.coeffRef(v, v) += on_diagonal;
  return system;
}

SparseCholesky::Rows rightSides(Eigen::Index rows, Eigen::Index columns) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> value(-1, 1);
  return SparseCholesky::Rows::NullaryExpr(rows, columns, [&] { return value(random); });
}

TEST(SparseCholesky, SolvesWhatADenseSolverSolves) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 9}, {3, 4}, {17, 23}, {40, 31}}) {
    const Sparse system = gridSystem(width, height, 0.01);
    const Sparse lower = system.triangularView<Eigen::Lower>();
    SparseCholesky::Rows x = rightSides(system.rows(), 5);
    const Eigen::MatrixXd expected = Eigen::MatrixXd(system).llt().solve(Eigen::MatrixXd(x));
    SparseCholesky(lower).solve(x);
    EXPECT_LT((x - expected).norm(), 1e-9 * expected.norm()) << width << " x " << height;
  }
}

TEST(SparseCholesky, GivesTheSameNumbersEveryTime) {
  const Sparse lower = gridSystem(40, 40, 0.001).triangularView<Eigen::Lower>();
  SparseCholesky::Rows first = rightSides(lower.rows(), 3);
  SparseCholesky::Rows right_sides = first;
  SparseCholesky(lower).solve(first);
  for (int run = 0; run < 5; ++run) {
    SparseCholesky::Rows again = right_sides;
    SparseCholesky(lower).solve(again);
    EXPECT_TRUE(again == first);
  }
}

TEST(SparseCholesky, WhatNothingHoldsStaysFinite) {
  // Two grids that do not meet; the diagonal of the second is all rounding.
  const Sparse held = gridSystem(9, 9, 0.01), loose = gridSystem(8, 8, 1e-18);
  std::vector<Eigen::Triplet<double>> entries;
  for (const auto& [matrix, first] : {std::pair{&held, Eigen::Index{0}}, {&loose, held.rows()}})
    for (Eigen::Index j = 0; j < matrix->outerSize(); ++j)
      for (Sparse::InnerIterator it(*matrix, j); it; ++it)
        if (it.row() >= j)
          entries.emplace_back(static_cast<int>(first + it.row()), static_cast<int>(first + j), it.value());
  Sparse lower(held.rows() + loose.rows(), held.rows() + loose.rows());
  lower.setFromTriplets(entries.begin(), entries.end());
  SparseCholesky::Rows x = rightSides(lower.rows(), 2);
  x.bottomRows(loose.rows()).setZero();
  const Eigen::MatrixXd expected = Eigen::MatrixXd(held).llt().solve(Eigen::MatrixXd(x.topRows(held.rows())));
  SparseCholesky(lower).solve(x);
  EXPECT_LT((x.topRows(held.rows()) - expected).norm(), 1e-9 * expected.norm());
  EXPECT_TRUE(x.bottomRows(loose.rows()).isZero());
}

TEST(SparseCholesky, RefusesWhatIsNotPositive) {
  Sparse lower = gridSystem(4, 4, 0.1).triangularView<Eigen::Lower>();
  lower.coeffRef(5, 5) = -1;
  EXPECT_THROW(SparseCholesky{lower}, std::runtime_error);
  lower.coeffRef(5, 5) = std::nan("");
  EXPECT_THROW(SparseCholesky{lower}, std::runtime_error);
}

}  // namespace
}  // namespace volto::rig
