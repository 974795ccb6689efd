#include "tests/bench/reference.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <Eigen/SparseCore>

namespace volto::bench {
namespace {

using Rows3 = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;

Eigen::Map<const Rows3> asRows(std::span<const Float3> points) {
  return {points.data()->data(), static_cast<Eigen::Index>(points.size()), 3};
}

}  // namespace

void csrDeform(std::span<const std::uint32_t> row_start, std::span<const std::uint8_t> point,
               std::span<const float> weight, std::span<const Float3> neutral, std::span<const Float3> displacement,
               std::span<Float3> out) {
  for (std::size_t v = 0; v < neutral.size(); ++v) {
    float x = neutral[v][0], y = neutral[v][1], z = neutral[v][2];
    for (std::uint32_t i = row_start[v]; i < row_start[v + 1]; ++i) {
      const Float3& d = displacement[point[i]];
      x += weight[i] * d[0];
      y += weight[i] * d[1];
      z += weight[i] * d[2];
    }
    out[v] = {x, y, z};
  }
}

struct EigenDeform::State {
  Eigen::SparseMatrix<float, Eigen::RowMajor> op;
  Rows3 neutral;
};

EigenDeform::EigenDeform(std::span<const std::uint32_t> row_start, std::span<const std::uint8_t> point,
                         std::span<const float> weight, std::span<const Float3> neutral)
    : state_(std::make_unique<State>()) {
  state_->neutral = asRows(neutral);
  std::vector<Eigen::Triplet<float>> entries;
  for (std::size_t v = 0; v < neutral.size(); ++v) {
    for (std::uint32_t i = row_start[v]; i < row_start[v + 1]; ++i)
      entries.emplace_back(static_cast<int>(v), point[i], weight[i]);
  }
  state_->op.resize(static_cast<Eigen::Index>(neutral.size()), 84);
  state_->op.setFromTriplets(entries.begin(), entries.end());
}
EigenDeform::~EigenDeform() = default;

void EigenDeform::deform(std::span<const Float3> displacement, std::span<Float3> out) const {
  Eigen::Map<Rows3> result(out.data()->data(), static_cast<Eigen::Index>(out.size()), 3);
  result = state_->neutral;
  result.noalias() += state_->op * asRows(displacement);
}

struct PerFrameRbf::State {
  struct Triangle {
    std::vector<std::uint8_t> region;
    std::vector<std::uint32_t> vertices;
    std::vector<float> x, y, z;  // of the vertices, neutral
  };
  std::vector<Float3> controls;
  std::vector<Triangle> triangles;
  std::vector<Float3> neutral;
  std::size_t moved = 0;
  mutable Eigen::MatrixXd h, rhs, weights;
  mutable std::vector<float> sum;  // 3 by vertices of a triangle
};

PerFrameRbf::PerFrameRbf(std::span<const Float3> controls, const std::vector<std::vector<std::uint8_t>>& region,
                         std::span<const std::int16_t> triangle, std::span<const Float3> neutral)
    : state_(std::make_unique<State>()) {
  state_->controls.assign(controls.begin(), controls.end());
  state_->neutral.assign(neutral.begin(), neutral.end());
  state_->triangles.resize(region.size());
  std::size_t most = 0;
  for (std::size_t t = 0; t < region.size(); ++t) state_->triangles[t].region = region[t];
  for (std::size_t v = 0; v < neutral.size(); ++v) {
    if (triangle[v] < 0) continue;
    State::Triangle& t = state_->triangles[static_cast<std::size_t>(triangle[v])];
    t.vertices.push_back(static_cast<std::uint32_t>(v));
    t.x.push_back(neutral[v][0]);
    t.y.push_back(neutral[v][1]);
    t.z.push_back(neutral[v][2]);
    most = std::max(most, t.vertices.size());
    ++state_->moved;
  }
  state_->sum.resize(3 * most);
}
PerFrameRbf::~PerFrameRbf() = default;
std::size_t PerFrameRbf::movedVertexCount() const { return state_->moved; }

void PerFrameRbf::deform(std::span<const Float3> displacement, std::span<Float3> out) const {
  const State& s = *state_;
  std::copy(s.neutral.begin(), s.neutral.end(), out.begin());
  for (const State::Triangle& t : s.triangles) {
    const auto n = static_cast<Eigen::Index>(t.region.size());
    s.h.resize(n, n);
    s.rhs.resize(n, 3);
    float stiffness[84];
    for (Eigen::Index j = 0; j < n; ++j) {
      const Float3& a = s.controls[t.region[static_cast<std::size_t>(j)]];
      double nearest = INFINITY;
      for (Eigen::Index i = 0; i < n; ++i) {
        const Float3& b = s.controls[t.region[static_cast<std::size_t>(i)]];
        const double dx = a[0] - b[0], dy = a[1] - b[1], dz = a[2] - b[2];
        const double squared = dx * dx + dy * dy + dz * dz;
        s.h(i, j) = squared;
        if (i != j) nearest = std::min(nearest, squared);
      }
      stiffness[j] = static_cast<float>(nearest);
      for (Eigen::Index i = 0; i < n; ++i) s.h(i, j) = std::sqrt(s.h(i, j) + nearest);
      const Float3& d = displacement[t.region[static_cast<std::size_t>(j)]];
      s.rhs.row(j) << d[0], d[1], d[2];
    }
    s.weights = Eigen::PartialPivLU<Eigen::Ref<Eigen::MatrixXd>>(s.h).solve(s.rhs);

    const std::size_t count = t.vertices.size();
    float* const sx = s.sum.data();
    float* const sy = sx + count;
    float* const sz = sy + count;
    std::fill_n(sx, 3 * count, 0.0F);
    for (Eigen::Index j = 0; j < n; ++j) {
      const Float3& c = s.controls[t.region[static_cast<std::size_t>(j)]];
      const float wx = static_cast<float>(s.weights(j, 0)), wy = static_cast<float>(s.weights(j, 1)),
                  wz = static_cast<float>(s.weights(j, 2));
      for (std::size_t v = 0; v < count; ++v) {
        const float dx = t.x[v] - c[0], dy = t.y[v] - c[1], dz = t.z[v] - c[2];
        const float h = std::sqrt(dx * dx + dy * dy + dz * dz + stiffness[j]);
        sx[v] += wx * h;
        sy[v] += wy * h;
        sz[v] += wz * h;
      }
    }
    for (std::size_t v = 0; v < count; ++v) {
      Float3& to = out[t.vertices[v]];
      to[0] += sx[v];
      to[1] += sy[v];
      to[2] += sz[v];
    }
  }
}

struct LeastSquares::State {
  Eigen::MatrixXd a, hessian;
  double step = 0;
};

LeastSquares::LeastSquares(std::span<const double> a, std::size_t rows, std::size_t columns)
    : state_(std::make_unique<State>()) {
  state_->a =
      Eigen::Map<const Eigen::MatrixXd>(a.data(), static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns));
  state_->hessian = state_->a.transpose() * state_->a;
  state_->step = 1.0 / state_->hessian.operatorNorm();
}
LeastSquares::~LeastSquares() = default;

namespace {
Eigen::Map<const Eigen::VectorXd> vec(std::span<const double> v) {
  return {v.data(), static_cast<Eigen::Index>(v.size())};
}
Eigen::Map<Eigen::VectorXd> vec(std::span<double> v) { return {v.data(), static_cast<Eigen::Index>(v.size())}; }
}  // namespace

void LeastSquares::byQr(std::span<const double> b, std::span<double> w) const {
  vec(w) = Eigen::HouseholderQR<Eigen::MatrixXd>(state_->a).solve(vec(b)).cwiseMax(0.0).cwiseMin(1.0);
}

void LeastSquares::byNnls(std::span<const double> b, std::span<double> w_out) const {
  const Eigen::MatrixXd& a = state_->a;
  const Eigen::Index n = a.cols();
  Eigen::VectorXd w = Eigen::VectorXd::Zero(n);
  std::vector<Eigen::Index> passive;
  std::vector<bool> is_passive(static_cast<std::size_t>(n), false);
  for (int iteration = 0; iteration < 3 * static_cast<int>(n); ++iteration) {
    const Eigen::VectorXd gradient = a.transpose() * (vec(b) - a * w);
    Eigen::Index best = -1;
    double most = 1e-9;
    for (Eigen::Index k = 0; k < n; ++k) {
      if (!is_passive[static_cast<std::size_t>(k)] && gradient[k] > most) {
        most = gradient[k];
        best = k;
      }
    }
    if (best < 0) break;
    passive.push_back(best);
    is_passive[static_cast<std::size_t>(best)] = true;
    while (!passive.empty()) {
      const auto m = static_cast<Eigen::Index>(passive.size());
      // Least squares on the passive columns by their normal equations: the quickest way that is still general.
      Eigen::MatrixXd sub(a.rows(), m);
      for (Eigen::Index j = 0; j < m; ++j) sub.col(j) = a.col(passive[static_cast<std::size_t>(j)]);
      Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(m, m);
      normal.selfadjointView<Eigen::Lower>().rankUpdate(sub.transpose());
      const Eigen::VectorXd s = normal.selfadjointView<Eigen::Lower>().llt().solve(sub.transpose() * vec(b));
      if (s.minCoeff() > 0.0) {
        for (Eigen::Index j = 0; j < m; ++j) w[passive[static_cast<std::size_t>(j)]] = s[j];
        break;
      }
      double alpha = 1.0;
      for (Eigen::Index j = 0; j < m; ++j) {
        const double now = w[passive[static_cast<std::size_t>(j)]];
        if (s[j] <= 0.0) alpha = std::min(alpha, now / (now - s[j]));
      }
      for (Eigen::Index j = 0; j < m; ++j) {
        double& now = w[passive[static_cast<std::size_t>(j)]];
        now += alpha * (s[j] - now);
      }
      std::erase_if(passive, [&](Eigen::Index k) {
        if (w[k] > 1e-12) return false;
        w[k] = 0.0;
        is_passive[static_cast<std::size_t>(k)] = false;
        return true;
      });
    }
  }
  vec(w_out) = w.cwiseMin(1.0);
}

void LeastSquares::exact(std::span<const double> b, std::span<double> w_out) const {
  const Eigen::VectorXd linear = state_->a.transpose() * vec(b);
  Eigen::VectorXd w = Eigen::VectorXd::Zero(linear.size()), y = w;
  double t = 1.0;
  for (int i = 0; i < 200000; ++i) {
    const Eigen::VectorXd next = (y - state_->step * (state_->hessian * y - linear)).cwiseMax(0.0).cwiseMin(1.0);
    const double change = (next - w).lpNorm<Eigen::Infinity>();
    if ((y - next).dot(next - w) > 0.0) {
      t = 1.0;  // overshot: restart the acceleration
      y = next;
    } else {
      const double t_next = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * t * t));
      y = next + (t - 1.0) / t_next * (next - w);
      t = t_next;
    }
    w = next;
    if (i > 10 && change < 1e-12) break;
  }
  vec(w_out) = w;
}

}  // namespace volto::bench
