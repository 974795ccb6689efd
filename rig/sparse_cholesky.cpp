#include "rig/sparse_cholesky.h"

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <limits>
#include <mutex>
#include <numeric>
#include <stdexcept>
#include <utility>

#include <Eigen/OrderingMethods>

#include "rig/parallel.h"

namespace volto::rig {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

constexpr Eigen::Index kBlock = 32;  // columns of a front that are factored before the others hear of it
// A column joins the front after it when that makes at most this share of the block's numbers zeros, or the front is
// small anyway.
constexpr double kZeros = 0.15;
constexpr std::int64_t kSmallFront = 12;
constexpr double kNothingLeft = 1e-15;  // of a diagonal entry

// Elimination order that keeps factors sparse; parents after their children in the elimination tree, and each subtree's
// columns together.
struct Ordering {
  std::vector<std::int32_t> order;   // elimination order -> row of the matrix
  std::vector<std::int32_t> parent;  // in elimination order, -1: a root
};

// Upper triangle's pattern in elimination order, by columns: for each column the earlier ones that it meets.
struct Earlier {
  std::vector<std::int32_t> start, column;
};

Earlier earlierColumns(const Sparse& lower, const std::vector<std::int32_t>& position) {
  Earlier out;
  out.start.assign(position.size() + 1, 0);
  const auto each = [&](const auto& visit) {
    for (Eigen::Index j = 0; j < lower.outerSize(); ++j)
      for (Sparse::InnerIterator it(lower, j); it; ++it) {
        const std::int32_t a = position[static_cast<std::size_t>(it.row())], b = position[static_cast<std::size_t>(j)];
        if (a != b) visit(std::max(a, b), std::min(a, b));
      }
  };
  each([&](std::int32_t late, std::int32_t) { ++out.start[static_cast<std::size_t>(late) + 1]; });
  for (std::size_t i = 0; i < position.size(); ++i) out.start[i + 1] += out.start[i];
  out.column.resize(static_cast<std::size_t>(out.start.back()));
  std::vector<std::int32_t> filled(out.start.begin(), out.start.end() - 1);
  each([&](std::int32_t late, std::int32_t early) {
    out.column[static_cast<std::size_t>(filled[static_cast<std::size_t>(late)]++)] = early;
  });
  return out;
}

std::vector<std::int32_t> positionsOf(const std::vector<std::int32_t>& order) {
  std::vector<std::int32_t> out(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) out[static_cast<std::size_t>(order[i])] = static_cast<std::int32_t>(i);
  return out;
}

// Liu's algorithm, with shortened paths.
std::vector<std::int32_t> eliminationTree(const Earlier& earlier) {
  const std::size_t count = earlier.start.size() - 1;
  std::vector<std::int32_t> parent(count, -1), ancestor(count, -1);
  for (std::size_t j = 0; j < count; ++j)
    for (std::int32_t e = earlier.start[j]; e < earlier.start[j + 1]; ++e)
      for (std::int32_t i = earlier.column[static_cast<std::size_t>(e)]; i != -1 && i < static_cast<std::int32_t>(j);) {
        const std::int32_t next = std::exchange(ancestor[static_cast<std::size_t>(i)], static_cast<std::int32_t>(j));
        if (next == -1) parent[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(j);
        i = next;
      }
  return parent;
}

std::vector<std::int32_t> postOrder(const std::vector<std::int32_t>& parent) {
  std::vector<std::int32_t> child(parent.size(), -1), sibling(parent.size(), -1), out, stack;
  for (std::size_t j = parent.size(); j-- > 0;)
    if (parent[j] >= 0) {
      sibling[j] = child[static_cast<std::size_t>(parent[j])];
      child[static_cast<std::size_t>(parent[j])] = static_cast<std::int32_t>(j);
    }
  out.reserve(parent.size());
  for (std::size_t root = 0; root < parent.size(); ++root) {
    if (parent[root] >= 0) continue;
    stack.push_back(static_cast<std::int32_t>(root));
    while (!stack.empty()) {
      const auto j = static_cast<std::size_t>(stack.back());
      if (const std::int32_t c = child[j]; c >= 0) {
        child[j] = sibling[static_cast<std::size_t>(c)];
        stack.push_back(c);
      } else {
        out.push_back(static_cast<std::int32_t>(j));
        stack.pop_back();
      }
    }
  }
  return out;
}

Ordering eliminationOrder(const Sparse& lower) {
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, std::int32_t> inverse;
  Eigen::AMDOrdering<std::int32_t>()(lower.selfadjointView<Eigen::Lower>(), inverse);
  const std::vector<std::int32_t> sparse_first(inverse.indices().data(), inverse.indices().data() + inverse.size());
  const std::vector<std::int32_t> parent = eliminationTree(earlierColumns(lower, positionsOf(sparse_first)));
  const std::vector<std::int32_t> post = postOrder(parent), position = positionsOf(post);
  Ordering out;
  for (const std::int32_t j : post) {
    out.order.push_back(sparse_first[static_cast<std::size_t>(j)]);
    const std::int32_t above = parent[static_cast<std::size_t>(j)];
    out.parent.push_back(above < 0 ? -1 : position[static_cast<std::size_t>(above)]);
  }
  return out;
}

// Numbers of each column of the factors, its diagonal included.
std::vector<std::int64_t> columnCounts(const Earlier& earlier, const std::vector<std::int32_t>& parent) {
  std::vector<std::int64_t> out(parent.size(), 1);
  std::vector<std::int32_t> seen(parent.size(), -1);
  for (std::size_t j = 0; j < parent.size(); ++j) {
    const auto row = static_cast<std::int32_t>(j);
    seen[j] = row;
    for (std::int32_t e = earlier.start[j]; e < earlier.start[j + 1]; ++e)
      for (std::int32_t i = earlier.column[static_cast<std::size_t>(e)]; seen[static_cast<std::size_t>(i)] != row;
           i = parent[static_cast<std::size_t>(i)]) {
        seen[static_cast<std::size_t>(i)] = row;
        ++out[static_cast<std::size_t>(i)];
      }
  }
  return out;
}

// First columns of the fronts. Neighbouring columns are one front where the later one is the earlier one's parent and
// few zeros are gained.
std::vector<std::int32_t> frontStarts(const std::vector<std::int32_t>& parent, const std::vector<std::int64_t>& count) {
  struct Open {
    std::int32_t first;
    std::int64_t numbers;  // without the zeros
  };
  std::vector<Open> open;
  for (std::size_t j = 0; j < parent.size(); ++j) {
    open.push_back({static_cast<std::int32_t>(j), count[j]});
    // What ends at j - 1 with parent j may join.
    while (open.size() > 1) {
      const Open &last = open.back(), &before = open[open.size() - 2];
      if (parent[static_cast<std::size_t>(last.first) - 1] != last.first || last.first != static_cast<std::int32_t>(j))
        break;
      const std::int64_t columns = static_cast<std::int64_t>(j) + 1 - before.first;
      const std::int64_t numbers = before.numbers + last.numbers;
      const std::int64_t block = columns * (columns - 1) / 2 + columns * count[j];
      if (columns > kSmallFront && static_cast<double>(block - numbers) > kZeros * static_cast<double>(block)) break;
      open[open.size() - 2].numbers = numbers;
      open.pop_back();
      break;
    }
  }
  std::vector<std::int32_t> out;
  for (const Open& o : open) out.push_back(o.first);
  return out;
}

// Lower Cholesky factor of the first columns of `front` (lower triangle), in place, and what they take from the rest.
void factorColumns(Eigen::MatrixXd& front, Eigen::Index columns, const Eigen::VectorXd& whole) {
  const Eigen::Index size = front.rows();
  for (Eigen::Index k = 0; k < columns; k += kBlock) {
    const Eigen::Index width = std::min(kBlock, columns - k), below = size - k - width;
    for (Eigen::Index j = k; j < k + width; ++j) {
      double pivot = front(j, j);
      if (!(pivot > kNothingLeft * whole[j])) pivot = whole[j];
      const double root = std::sqrt(pivot);
      const Eigen::Index left = k + width - j - 1;
      front(j, j) = root;
      front.col(j).segment(j + 1, left) /= root;
      for (Eigen::Index i = j + 1; i < k + width; ++i)
        front.col(i).segment(i, k + width - i) -= front(i, j) * front.col(j).segment(i, k + width - i);
    }
    if (below == 0) continue;
    auto panel = front.block(k + width, k, below, width);
    front.block(k, k, width, width).triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(panel);
    front.bottomRightCorner(below, below).selfadjointView<Eigen::Lower>().rankUpdate(panel, -1.0);
  }
}

}  // namespace

struct SparseCholesky::Plan {
  // Entries of the matrix by the column that is eliminated first, rows in elimination order.
  std::vector<std::int32_t> start, row;
  std::vector<double> value;
  Eigen::VectorXd diagonal;
  std::vector<std::int32_t> parent;                 // of each front, -1: a root
  std::vector<std::vector<std::int32_t>> children;  // of each front, ascending
};

void SparseCholesky::analyse(const Sparse& lower, Plan& plan) {
  Ordering ordering = eliminationOrder(lower);
  order_ = std::move(ordering.order);
  const std::vector<std::int32_t> position = positionsOf(order_);
  const Earlier earlier = earlierColumns(lower, position);
  const std::size_t count = order_.size();

  plan.start.assign(count + 1, 0);
  plan.diagonal.setZero(static_cast<Eigen::Index>(count));
  const auto each = [&](const auto& visit) {
    for (Eigen::Index j = 0; j < lower.outerSize(); ++j)
      for (Sparse::InnerIterator it(lower, j); it; ++it) {
        const std::int32_t a = position[static_cast<std::size_t>(it.row())], b = position[static_cast<std::size_t>(j)];
        visit(std::min(a, b), std::max(a, b), it.value());
      }
  };
  each([&](std::int32_t column, std::int32_t, double) { ++plan.start[static_cast<std::size_t>(column) + 1]; });
  for (std::size_t i = 0; i < count; ++i) plan.start[i + 1] += plan.start[i];
  plan.row.resize(static_cast<std::size_t>(plan.start.back()));
  plan.value.resize(plan.row.size());
  std::vector<std::int32_t> filled(plan.start.begin(), plan.start.end() - 1);
  bool usable = true;
  each([&](std::int32_t column, std::int32_t row, double value) {
    const auto at = static_cast<std::size_t>(filled[static_cast<std::size_t>(column)]++);
    plan.row[at] = row;
    plan.value[at] = value;
    if (row == column) plan.diagonal[column] += value;
    usable = usable && std::isfinite(value);
  });
  if (!usable || !(plan.diagonal.array() > 0).all())
    throw std::runtime_error("sparse factors: the matrix is not positive definite");

  const std::vector<std::int32_t> starts = frontStarts(ordering.parent, columnCounts(earlier, ordering.parent));
  std::vector<std::int32_t> front_of(count);
  fronts_.resize(starts.size());
  for (std::size_t f = 0; f < starts.size(); ++f) {
    const std::int32_t end = f + 1 < starts.size() ? starts[f + 1] : static_cast<std::int32_t>(count);
    fronts_[f].first = starts[f];
    fronts_[f].columns = end - starts[f];
    for (std::int32_t j = starts[f]; j < end; ++j) front_of[static_cast<std::size_t>(j)] = static_cast<std::int32_t>(f);
  }
  plan.parent.assign(fronts_.size(), -1);
  plan.children.resize(fronts_.size());
  std::vector<std::int32_t> seen(count, -1);
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    Front& front = fronts_[f];
    const std::int32_t end = front.first + front.columns;
    const auto mark = static_cast<std::int32_t>(f);
    const auto take = [&](std::int32_t row) {
      if (row < end || seen[static_cast<std::size_t>(row)] == mark) return;
      seen[static_cast<std::size_t>(row)] = mark;
      front.rows.push_back(row);
    };
    for (std::int32_t e = plan.start[static_cast<std::size_t>(front.first)];
         e < plan.start[static_cast<std::size_t>(end)]; ++e)
      take(plan.row[static_cast<std::size_t>(e)]);
    for (const std::int32_t c : plan.children[f]) {
      const Front& child = fronts_[static_cast<std::size_t>(c)];
      for (auto row = child.rows.begin() + child.columns; row != child.rows.end(); ++row) take(*row);
    }
    std::sort(front.rows.begin(), front.rows.end());
    std::vector<std::int32_t> own(static_cast<std::size_t>(front.columns));
    std::iota(own.begin(), own.end(), front.first);
    front.rows.insert(front.rows.begin(), own.begin(), own.end());
    if (static_cast<std::int32_t>(front.rows.size()) > front.columns) {
      plan.parent[f] = front_of[static_cast<std::size_t>(front.rows[static_cast<std::size_t>(front.columns)])];
      plan.children[static_cast<std::size_t>(plan.parent[f])].push_back(mark);
    }
  }
}

void SparseCholesky::factorFront(const Plan& plan, std::size_t f, std::vector<Eigen::MatrixXd>& updates) {
  Front& front = fronts_[f];
  const auto size = static_cast<Eigen::Index>(front.rows.size());
  const auto placeOf = [&](std::int32_t row) -> Eigen::Index {
    if (row < front.first + front.columns) return row - front.first;
    return std::lower_bound(front.rows.begin() + front.columns, front.rows.end(), row) - front.rows.begin();
  };
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(size, size);
  for (std::int32_t j = 0; j < front.columns; ++j) {
    const auto column = static_cast<std::size_t>(front.first + j);
    for (std::int32_t e = plan.start[column]; e < plan.start[column + 1]; ++e)
      dense(placeOf(plan.row[static_cast<std::size_t>(e)]), j) += plan.value[static_cast<std::size_t>(e)];
  }
  std::vector<Eigen::Index> place;
  for (const std::int32_t c : plan.children[f]) {
    const Front& child = fronts_[static_cast<std::size_t>(c)];
    Eigen::MatrixXd& update = updates[static_cast<std::size_t>(c)];
    place.clear();
    for (auto row = child.rows.begin() + child.columns; row != child.rows.end(); ++row) place.push_back(placeOf(*row));
    for (Eigen::Index b = 0; b < update.cols(); ++b) {
      double* const into = dense.col(place[static_cast<std::size_t>(b)]).data();
      const double* const from = update.col(b).data();
      for (Eigen::Index a = b; a < update.rows(); ++a) into[place[static_cast<std::size_t>(a)]] += from[a];
    }
    update.resize(0, 0);
  }
  factorColumns(dense, front.columns, plan.diagonal.segment(front.first, front.columns));
  front.factor = dense.leftCols(front.columns);
  if (size > front.columns) updates[f] = dense.bottomRightCorner(size - front.columns, size - front.columns);
}

SparseCholesky::SparseCholesky(const Sparse& lower) {
  Plan plan;
  analyse(lower, plan);
  // Subtrees small enough are one piece of work; above them each front is, as soon as its children are done.
  std::vector<double> cost(fronts_.size());
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    const auto rows = static_cast<double>(fronts_[f].rows.size());
    cost[f] += rows * rows * fronts_[f].columns;
    if (plan.parent[f] >= 0) cost[static_cast<std::size_t>(plan.parent[f])] += cost[f];
  }
  double total = 0;
  for (std::size_t f = 0; f < fronts_.size(); ++f) total += plan.parent[f] < 0 ? cost[f] : 0;
  const double small = total / 64;
  std::vector<std::size_t> first(fronts_.size());  // of the fronts of each one's subtree
  std::vector<std::size_t> pending(fronts_.size(), 0), ready;
  std::vector<std::uint8_t> is_task(fronts_.size(), 0);
  std::size_t left = 0;
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    first[f] = plan.children[f].empty() ? f : first[static_cast<std::size_t>(plan.children[f].front())];
    const std::int32_t above = plan.parent[f];
    is_task[f] = cost[f] > small || above < 0 || cost[static_cast<std::size_t>(above)] > small ? 1 : 0;
    if (is_task[f] == 0) continue;
    ++left;
    if (cost[f] > small) pending[f] = plan.children[f].size();
    if (pending[f] == 0) ready.push_back(f);
  }
  std::reverse(ready.begin(), ready.end());  // taken from the back

  std::vector<Eigen::MatrixXd> updates(fronts_.size());
  std::mutex mutex;
  std::condition_variable changed;
  std::exception_ptr failure;
  constexpr std::size_t kThreads = 8;
  parallelFor(kThreads, [&](std::size_t) {
    std::unique_lock lock(mutex);
    while (true) {
      changed.wait(lock, [&] { return left == 0 || failure || !ready.empty(); });
      if (left == 0 || failure) return;
      const std::size_t task = ready.back();
      ready.pop_back();
      lock.unlock();
      std::exception_ptr own;
      try {
        for (std::size_t f = cost[task] > small ? task : first[task]; f <= task; ++f) factorFront(plan, f, updates);
      } catch (...) {
        own = std::current_exception();
      }
      lock.lock();
      if (own) failure = own;
      --left;
      if (const std::int32_t above = plan.parent[task]; above >= 0 && --pending[static_cast<std::size_t>(above)] == 0)
        ready.push_back(static_cast<std::size_t>(above));
      changed.notify_all();
    }
  });
  if (failure) std::rethrow_exception(failure);
}

void SparseCholesky::solve(Rows& x) const {
  const Eigen::Index columns = x.cols();
  Rows y(x.rows(), columns), gathered;
  for (Eigen::Index i = 0; i < x.rows(); ++i) y.row(i) = x.row(order_[static_cast<std::size_t>(i)]);
  for (const Front& front : fronts_) {
    const auto below = static_cast<Eigen::Index>(front.rows.size()) - front.columns;
    auto own = y.middleRows(front.first, front.columns);
    front.factor.topRows(front.columns).triangularView<Eigen::Lower>().solveInPlace(own);
    if (below == 0) continue;
    gathered.noalias() = front.factor.bottomRows(below) * own;
    for (Eigen::Index i = 0; i < below; ++i)
      y.row(front.rows[static_cast<std::size_t>(front.columns + i)]) -= gathered.row(i);
  }
  for (auto front = fronts_.rbegin(); front != fronts_.rend(); ++front) {
    const auto below = static_cast<Eigen::Index>(front->rows.size()) - front->columns;
    auto own = y.middleRows(front->first, front->columns);
    if (below > 0) {
      gathered.resize(below, columns);
      for (Eigen::Index i = 0; i < below; ++i)
        gathered.row(i) = y.row(front->rows[static_cast<std::size_t>(front->columns + i)]);
      own.noalias() -= front->factor.bottomRows(below).transpose() * gathered;
    }
    front->factor.topRows(front->columns).triangularView<Eigen::Lower>().transpose().solveInPlace(own);
  }
  for (Eigen::Index i = 0; i < x.rows(); ++i) x.row(order_[static_cast<std::size_t>(i)]) = y.row(i);
}

}  // namespace volto::rig
