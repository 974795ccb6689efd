#include "rig/skin_equations.h"

#include <algorithm>
#include <optional>

#include <Eigen/SparseCore>

#include "rig/sparse_cholesky.h"

namespace volto::rig {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

// Where bending gives way to tension, in eye separations: the reach of what a border of the data says about the slope
// beyond it. Bending alone goes on with that slope deep into the mouth, and a different mesh has a different slope.
constexpr double kTensionLength = 0.08;
// Over what length, in eye separations, a tied vertex may differ from the place that it is tied to.
constexpr double kTieLength = 0.15;

}  // namespace

struct SkinEquations::State {
  struct Held {
    std::uint32_t point;
    std::int32_t unknown;
    double weight;
  };
  std::vector<double> data_scale;  // per unknown
  std::vector<Held> held;
  std::optional<SparseCholesky> factors;
};

SkinEquations::SkinEquations(const Skin& skin, std::span<const std::int32_t> unknown,
                             std::span<const double> data_weight, std::span<const SkinPoint> points,
                             std::span<const SkinTie> ties, double eye_separation)
    : state_(std::make_unique<State>()) {
  const double es2 = eye_separation * eye_separation;
  const auto areaOf = [&](std::uint32_t v) { return std::max(skin.area[v] / es2, 1e-9); };
  const auto unknowns = static_cast<Eigen::Index>(data_weight.size());
  const auto vertices = static_cast<std::uint32_t>(skin.same_as.size());

  // Sum over unknowns v of |(L x)_v|^2 / area_v = |B x|^2, L among the unknowns alone: free at their outer border.
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::Index stencils = 0;
  for (std::uint32_t v = 0; v < vertices; ++v) {
    if (!skin.stands(v) || unknown[v] < 0) continue;
    const double scale = 1 / std::sqrt(areaOf(v));
    double own = 0;
    for (std::uint32_t e = skin.graph.start[v]; e < skin.graph.start[v + 1]; ++e)
      if (const std::int32_t u = unknown[skin.graph.neighbour[e]]; u >= 0) {
        own -= skin.laplacian[e];
        entries.emplace_back(stencils, u, scale * skin.laplacian[e]);
      }
    entries.emplace_back(stencils++, unknown[v], scale * own);
  }
  Sparse bending(stencils, unknowns);
  bending.setFromTriplets(entries.begin(), entries.end());
  entries.clear();
  Sparse system(unknowns, unknowns);
  system.selfadjointView<Eigen::Lower>().rankUpdate(Sparse(bending.transpose()));
  bending = Sparse();

  state_->data_scale.assign(data_weight.size(), 0.0);
  for (std::uint32_t v = 0; v < vertices; ++v) {
    if (!skin.stands(v) || unknown[v] < 0) continue;
    const auto row = static_cast<std::size_t>(unknown[v]);
    // A trace of weight everywhere keeps a piece of skin without any point solvable.
    state_->data_scale[row] = areaOf(v) * (data_weight[row] + 1e-9);
    entries.emplace_back(unknown[v], unknown[v], state_->data_scale[row]);
  }
  // Tension, as far as a triangle's corners have no data.
  for (const CotangentTriangle& triangle : skin.cotangents) {
    std::array<std::int32_t, 3> at{};
    double bare = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      at[i] = unknown[triangle.vertices[i]];
      if (at[i] >= 0 && !(data_weight[static_cast<std::size_t>(at[i])] > 0)) bare += 1.0 / 3;
    }
    if (!(bare > 0) || at[0] < 0 || at[1] < 0 || at[2] < 0) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      const double pull = bare * triangle.weight[i] / (kTensionLength * kTensionLength);
      const std::int32_t u = at[(i + 1) % 3], v = at[(i + 2) % 3];
      entries.emplace_back(u, u, pull);
      entries.emplace_back(v, v, pull);
      entries.emplace_back(std::max(u, v), std::min(u, v), -pull);
    }
  }
  for (const SkinTie& tie : ties) {
    const double weight = tie.share * areaOf(tie.vertex) * std::pow(2 * 3.14159265358979 / kTieLength, 4);
    const std::array<std::int32_t, 4> at{unknown[tie.vertex], unknown[tie.to[0]], unknown[tie.to[1]],
                                         unknown[tie.to[2]]};
    const std::array<double, 4> of{1, -tie.weight[0], -tie.weight[1], -tie.weight[2]};
    if (std::any_of(at.begin(), at.end(), [](std::int32_t u) { return u < 0; })) continue;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < 4; ++j)
        if (at[i] >= at[j]) entries.emplace_back(at[i], at[j], weight * of[i] * of[j]);
  }
  // Points are held by a weight far above all others; the rows of points that are vertices are set exactly afterwards.
  for (std::uint32_t p = 0; p < points.size(); ++p) {
    const double weight = 1e5 / areaOf(points[p].around.front().vertex);
    for (std::size_t i = 0; i < points[p].around.size(); ++i) {
      const std::int32_t a = unknown[points[p].around[i].vertex];
      if (a < 0) continue;
      state_->held.push_back({p, a, weight * points[p].weight[i]});
      for (std::size_t j = 0; j < points[p].around.size(); ++j)
        if (const std::int32_t b = unknown[points[p].around[j].vertex]; b >= 0 && a >= b)
          entries.emplace_back(a, b, weight * points[p].weight[i] * points[p].weight[j]);
    }
  }
  Sparse more(unknowns, unknowns);
  more.setFromTriplets(entries.begin(), entries.end());
  entries = {};
  system = Sparse(system.triangularView<Eigen::Lower>()) + more;

  state_->factors.emplace(system);
}

SkinEquations::~SkinEquations() = default;
SkinEquations::SkinEquations(SkinEquations&&) noexcept = default;
SkinEquations& SkinEquations::operator=(SkinEquations&&) noexcept = default;

void SkinEquations::solve(const Columns& values, Columns& data) const {
  const State& s = *state_;
  for (Eigen::Index row = 0; row < data.rows(); ++row) data.row(row) *= s.data_scale[static_cast<std::size_t>(row)];
  for (const State::Held& h : s.held) data.row(h.unknown) += h.weight * values.row(h.point);
  s.factors->solve(data);
}

}  // namespace volto::rig
