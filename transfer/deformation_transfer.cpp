#include "transfer/deformation_transfer.h"

#include <atomic>
#include <cmath>
#include <stdexcept>
#include <thread>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "transfer/sparse_cholesky.h"

namespace volto::transfer {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using Row = Eigen::Matrix<double, 1, 3>;

constexpr std::size_t kExamplesPerPanel = SparseCholesky::kPanel / 3;

// Two edges and a normal of the length that scales with them (Sumner and Popovic, equation 1): turns of a triangle
// about its own edges count too.
Eigen::Matrix3d frameOf(const rig::VertexPositions& positions, const Triangle& t) {
  const Eigen::Vector3d a = positions.row(t[0]), b = positions.row(t[1]), c = positions.row(t[2]);
  Eigen::Matrix3d frame;
  frame.col(0) = b - a;
  frame.col(1) = c - a;
  const Eigen::Vector3d normal = frame.col(0).cross(frame.col(1));
  const double length = normal.norm();
  frame.col(2) = length > 0 ? Eigen::Vector3d(normal / std::sqrt(length)) : normal;
  return frame;
}

// A triangle of the target.
struct TargetTriangle {
  Triangle vertex;                // welded
  std::int32_t source;            // whose change of gradient it takes; kNone: stays as it is
  bool between_vertices = false;  // takes it from `place` instead
  SurfacePoint place;
  // Times the change of the source's frame, or of its gradient at `place`, the right-hand side of corners 1 and 2: area
  // times the gradients of their hat functions, in the coordinates of that frame.
  Eigen::Vector3d second, third;
};

// How one example differs from the source at rest.
struct Change {
  std::vector<bool> vertex_moved, triangle_moved;
  std::vector<Eigen::Matrix3d> frame;     // one per source triangle that is needed and moved
  std::vector<Eigen::Matrix3d> gradient;  // one per source vertex, mean of the triangles around; where it is needed
};

}  // namespace

struct DeformationTransfer::State {
  rig::VertexPositions source_neutral, target_neutral;
  std::vector<Triangle> source_triangles;
  std::vector<bool> source_needed;              // one per source triangle
  std::vector<Eigen::Matrix3d> source_frame;    // at rest
  std::vector<Eigen::Matrix3d> source_inverse;  // of them; zero for a degenerate triangle
  // Source triangles around each vertex and their shares of its gradient; empty where no place is between vertices.
  std::vector<std::uint32_t> around_start, around;
  std::vector<double> around_share;
  std::vector<TargetTriangle> triangles;
  std::vector<std::uint32_t> same_as;
  std::vector<std::int32_t> unknown;  // #V of the target: row in the system
  std::vector<std::uint32_t> vertex_of_unknown;
  std::vector<double> anchor;  // one per unknown: weight
  Correspondence correspondence;
  std::vector<SlitPair> pairs;
  std::vector<double> pair_stiffness;
  int threads = 1;
  std::unique_ptr<SparseCholesky> system;

  Eigen::Vector3d scaled(const Eigen::Vector3d& source_displacement, std::uint32_t vertex) const {
    const Eigen::Vector3d turned = correspondence.target_from_source * source_displacement;
    if (correspondence.displacement_scale.empty()) return turned;
    const Eigen::Vector3d& scale =
        correspondence.displacement_scale[correspondence.displacement_scale.size() == 1 ? 0 : vertex];
    const Eigen::Matrix3d& r = correspondence.target_from_head;
    return r * (scale.asDiagonal() * (r.transpose() * turned));
  }

  void measure(const rig::VertexPositions& example, Change& change) const {
    change.vertex_moved.resize(static_cast<std::size_t>(source_neutral.rows()));
    for (std::size_t v = 0; v < change.vertex_moved.size(); ++v) {
      const auto row = static_cast<Eigen::Index>(v);
      change.vertex_moved[v] = example.row(row) != source_neutral.row(row);
    }
    change.triangle_moved.resize(source_triangles.size());
    change.frame.resize(source_triangles.size());
    for (std::size_t s = 0; s < source_triangles.size(); ++s) {
      const Triangle& t = source_triangles[s];
      change.triangle_moved[s] =
          source_needed[s] && (change.vertex_moved[t[0]] || change.vertex_moved[t[1]] || change.vertex_moved[t[2]]);
      if (change.triangle_moved[s]) change.frame[s] = frameOf(example, t) - source_frame[s];
    }
    if (around_start.empty()) return;
    change.gradient.resize(change.vertex_moved.size());
    for (std::size_t v = 0; v + 1 < around_start.size(); ++v) {
      change.gradient[v].setZero();
      for (std::uint32_t e = around_start[v]; e < around_start[v + 1]; ++e)
        if (change.triangle_moved[around[e]])
          change.gradient[v] += around_share[e] * (change.frame[around[e]] * source_inverse[around[e]]);
    }
  }

  // Adds one example to columns 3k, 3k+1, 3k+2 of a panel: what it changes of the right-hand side at rest.
  void addRightHandSide(const rig::VertexPositions& example, std::size_t k, std::vector<double>& panel,
                        Change& change) const {
    const Eigen::Matrix3d& r = correspondence.target_from_source;
    measure(example, change);
    const auto add = [&](std::uint32_t vertex, const Eigen::Vector3d& value) {
      double* const row = panel.data() + static_cast<std::size_t>(unknown[vertex]) * SparseCholesky::kPanel + 3 * k;
      row[0] += value.x();
      row[1] += value.y();
      row[2] += value.z();
    };
    for (const TargetTriangle& t : triangles) {
      Eigen::Matrix3d turned;
      if (t.between_vertices) {
        turned.setZero();
        for (std::size_t i = 0; i < 3; ++i) turned += t.place.weight[i] * change.gradient[t.place.vertex[i]];
        turned = r * turned;
      } else if (t.source >= 0 && change.triangle_moved[static_cast<std::size_t>(t.source)]) {
        turned = r * change.frame[static_cast<std::size_t>(t.source)];
      } else {
        continue;
      }
      const Eigen::Vector3d second = turned * t.second, third = turned * t.third;
      add(t.vertex[0], -(second + third));
      add(t.vertex[1], second);
      add(t.vertex[2], third);
    }
    for (std::size_t u = 0; u < vertex_of_unknown.size(); ++u) {
      const std::uint32_t v = vertex_of_unknown[u];
      const SurfacePoint& on_source = correspondence.source_point[v];
      if (!change.vertex_moved[on_source.vertex[0]] && !change.vertex_moved[on_source.vertex[1]] &&
          !change.vertex_moved[on_source.vertex[2]])
        continue;
      if (isNone(on_source)) continue;
      add(v, anchor[u] * scaled(at(example, on_source) - at(source_neutral, on_source), v));
    }
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      const SlitPair& pair = pairs[p];
      const Eigen::Vector3d source_rest = at(source_neutral, pair.source_upper) - at(source_neutral, pair.source_lower);
      const Eigen::Vector3d source_now = at(example, pair.source_upper) - at(example, pair.source_lower);
      const Eigen::Vector3d gap = pair.gap_scale * (r * (source_now - source_rest));
      for (int i = 0; i < 3; ++i) {
        add(same_as[pair.target_upper.vertex[i]], pair_stiffness[p] * pair.target_upper.weight[i] * gap);
        add(same_as[pair.target_lower.vertex[i]], -pair_stiffness[p] * pair.target_lower.weight[i] * gap);
      }
    }
  }

  void solvePanel(std::span<const rig::VertexPositions> examples, std::span<rig::VertexPositions> results) const {
    std::vector<double> panel(system->size() * SparseCholesky::kPanel, 0.0), scratch;
    Change change;
    for (std::size_t k = 0; k < examples.size(); ++k) addRightHandSide(examples[k], k, panel, change);
    system->solve(panel, scratch);
    for (std::size_t k = 0; k < examples.size(); ++k) {
      results[k].resize(target_neutral.rows(), 3);
      for (std::size_t v = 0; v < same_as.size(); ++v) {
        const double* const row =
            panel.data() + static_cast<std::size_t>(unknown[same_as[v]]) * SparseCholesky::kPanel + 3 * k;
        results[k].row(static_cast<Eigen::Index>(v)) =
            target_neutral.row(static_cast<Eigen::Index>(v)) + Eigen::RowVector3d(row[0], row[1], row[2]);
      }
    }
  }

  // The triangles around every vertex that some place lies beside, by area.
  void gatherAround() {
    std::vector<bool> wanted(static_cast<std::size_t>(source_neutral.rows()), false);
    bool any = false;
    for (const TargetTriangle& t : triangles)
      if (t.between_vertices)
        for (const std::uint32_t v : t.place.vertex) any = wanted[v] = true;
    if (!any) return;
    around_start.assign(wanted.size() + 1, 0);
    const auto twiceArea = [&](std::size_t s) { return source_frame[s].col(2).squaredNorm(); };
    std::vector<double> total(wanted.size(), 0.0);
    const auto counts = [&](std::size_t s, std::uint32_t v) { return wanted[v] && !source_inverse[s].isZero(0); };
    for (std::size_t s = 0; s < source_triangles.size(); ++s)
      for (const std::uint32_t v : source_triangles[s])
        if (counts(s, v)) {
          ++around_start[v + 1];
          total[v] += twiceArea(s);
          source_needed[s] = true;
        }
    for (std::size_t v = 0; v < wanted.size(); ++v) around_start[v + 1] += around_start[v];
    around.resize(around_start.back());
    around_share.resize(around_start.back());
    std::vector<std::uint32_t> next(around_start.begin(), around_start.end() - 1);
    for (std::size_t s = 0; s < source_triangles.size(); ++s)
      for (const std::uint32_t v : source_triangles[s])
        if (counts(s, v)) {
          around[next[v]] = static_cast<std::uint32_t>(s);
          around_share[next[v]++] = twiceArea(s) / total[v];
        }
  }
};

Correspondence sameTopology(const rig::Mesh& mesh) {
  Correspondence c;
  c.source_triangle.resize(rig::triangulate(mesh).size());
  for (std::size_t t = 0; t < c.source_triangle.size(); ++t) c.source_triangle[t] = static_cast<std::int32_t>(t);
  c.source_point.resize(mesh.vertexCount());
  for (std::uint32_t v = 0; v < c.source_point.size(); ++v) c.source_point[v] = {{v, v, v}, {1, 0, 0}};
  return c;
}

DeformationTransfer::DeformationTransfer(const rig::VertexPositions& source_neutral,
                                         std::span<const Triangle> source_triangles,
                                         const rig::VertexPositions& target_neutral,
                                         std::span<const Triangle> target_triangles,
                                         std::span<const std::uint32_t> same_as, Correspondence correspondence,
                                         std::vector<SlitPair> pairs, double eye_separation,
                                         const DeformationTransferOptions& options)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  const auto vertices = static_cast<std::size_t>(target_neutral.rows());
  if (correspondence.source_triangle.size() != target_triangles.size() ||
      correspondence.source_point.size() != vertices || (!same_as.empty() && same_as.size() != vertices) ||
      !(eye_separation > 0) ||
      (!correspondence.source_place.empty() && correspondence.source_place.size() != target_triangles.size()) ||
      (!correspondence.anchor_share.empty() && correspondence.anchor_share.size() != vertices) ||
      (correspondence.displacement_scale.size() > 1 && correspondence.displacement_scale.size() != vertices))
    throw std::invalid_argument("DeformationTransfer: sizes do not fit together");
  s.source_neutral = source_neutral;
  s.target_neutral = target_neutral;
  s.source_triangles.assign(source_triangles.begin(), source_triangles.end());
  s.same_as.assign(same_as.begin(), same_as.end());
  if (same_as.empty())
    for (std::uint32_t v = 0; v < vertices; ++v) s.same_as.push_back(v);
  s.correspondence = std::move(correspondence);
  s.pairs = std::move(pairs);
  s.threads =
      options.threads > 0 ? options.threads : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));

  s.source_inverse.resize(source_triangles.size());
  s.source_frame.resize(source_triangles.size());
  s.source_needed.assign(source_triangles.size(), false);
  std::vector<bool> source_degenerate(source_triangles.size(), false);
  for (std::size_t t = 0; t < source_triangles.size(); ++t) {
    const Eigen::Matrix3d frame = frameOf(source_neutral, source_triangles[t]);
    const double size = frame.col(0).norm() * frame.col(1).norm();
    s.source_frame[t] = frame;
    source_degenerate[t] = !(frame.col(2).squaredNorm() > 1e-9 * size);  // |normal|^2 is twice the area
    if (source_degenerate[t])
      s.source_inverse[t].setZero();
    else
      s.source_inverse[t] = frame.inverse();
  }

  s.unknown.assign(vertices, -1);
  for (std::uint32_t v = 0; v < vertices; ++v) {
    if (s.same_as[v] != v) continue;
    s.unknown[v] = static_cast<std::int32_t>(s.vertex_of_unknown.size());
    s.vertex_of_unknown.push_back(v);
  }
  std::vector<double> area(s.vertex_of_unknown.size(), 0.0);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(target_triangles.size() * 6);
  for (std::size_t i = 0; i < target_triangles.size(); ++i) {
    TargetTriangle t{};
    for (int k = 0; k < 3; ++k) t.vertex[k] = s.same_as[target_triangles[i][k]];
    if (t.vertex[0] == t.vertex[1] || t.vertex[1] == t.vertex[2] || t.vertex[2] == t.vertex[0]) continue;
    const Eigen::Matrix3d frame = frameOf(target_neutral, t.vertex);
    if (!(frame.col(2).squaredNorm() > 1e-9 * frame.col(0).norm() * frame.col(1).norm())) continue;
    const Eigen::Matrix3d inverse = frame.inverse();
    const std::array<Eigen::Vector3d, 3> gradient = {-(inverse.row(0) + inverse.row(1)).transpose(), inverse.row(0),
                                                     inverse.row(1)};
    const double t_area = 0.5 * frame.col(2).squaredNorm();
    t.source = s.correspondence.source_triangle[i];
    if (t.source >= 0 && source_degenerate[static_cast<std::size_t>(t.source)]) t.source = Correspondence::kNone;
    if (!s.correspondence.source_place.empty()) t.place = s.correspondence.source_place[i];
    t.between_vertices = !isNone(t.place);
    Eigen::Matrix3d to_source = s.correspondence.target_from_source.transpose();
    if (t.between_vertices)
      t.source = Correspondence::kNone;
    else if (t.source >= 0)
      to_source = s.source_inverse[static_cast<std::size_t>(t.source)] * to_source;
    if (t.source >= 0) s.source_needed[static_cast<std::size_t>(t.source)] = true;
    t.second = t_area * (to_source * gradient[1]);
    t.third = t_area * (to_source * gradient[2]);
    for (int a = 0; a < 3; ++a) {
      area[static_cast<std::size_t>(s.unknown[t.vertex[a]])] += t_area / 3;
      for (int b = 0; b < 3; ++b) {
        const std::int32_t row = s.unknown[t.vertex[a]], column = s.unknown[t.vertex[b]];
        if (row >= column) entries.emplace_back(row, column, t_area * gradient[a].dot(gradient[b]));
      }
    }
    s.triangles.push_back(t);
  }
  s.gatherAround();
  double mean_area = 0;
  for (const double a : area) mean_area += a / static_cast<double>(area.size());
  const double unit = 1 / (eye_separation * eye_separation);
  s.anchor.resize(area.size());
  for (std::size_t u = 0; u < area.size(); ++u) {
    const bool none = isNone(s.correspondence.source_point[s.vertex_of_unknown[u]]);
    // A vertex in no triangle needs its place too.
    const double share =
        s.correspondence.anchor_share.empty() ? 1.0 : s.correspondence.anchor_share[s.vertex_of_unknown[u]];
    // Some of it remains: a piece that hangs on nothing would have no place at all.
    const double firmness = none ? options.hold : options.anchor * std::max(share, 1e-4);
    s.anchor[u] = firmness * unit * std::max(area[u], 1e-3 * mean_area);
    entries.emplace_back(static_cast<int>(u), static_cast<int>(u), s.anchor[u]);
  }
  for (const SlitPair& pair : s.pairs) {
    const double stiffness = options.slit_stiffness;  // a Laplace matrix's entries are about 1, whatever the unit
    s.pair_stiffness.push_back(stiffness);
    const auto corner = [&](int i) {
      const SurfacePoint& p = i < 3 ? pair.target_upper : pair.target_lower;
      return std::pair{s.unknown[s.same_as[p.vertex[i % 3]]], (i < 3 ? 1.0 : -1.0) * p.weight[i % 3]};
    };
    for (int a = 0; a < 6; ++a)
      for (int b = 0; b < 6; ++b)
        if (const auto [row, x] = corner(a); x != 0)
          if (const auto [column, y] = corner(b); y != 0 && row >= column)
            entries.emplace_back(row, column, stiffness * x * y);
  }
  const auto n = static_cast<Eigen::Index>(s.vertex_of_unknown.size());
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  s.system = std::make_unique<SparseCholesky>(matrix);
}

DeformationTransfer::~DeformationTransfer() = default;
DeformationTransfer::DeformationTransfer(DeformationTransfer&&) noexcept = default;
DeformationTransfer& DeformationTransfer::operator=(DeformationTransfer&&) noexcept = default;

std::vector<rig::VertexPositions> DeformationTransfer::transfer(std::span<const rig::VertexPositions> examples) const {
  const State& s = *state_;
  for (const rig::VertexPositions& example : examples)
    if (example.rows() != s.source_neutral.rows())
      throw std::invalid_argument("DeformationTransfer: an example with another number of vertices");
  std::vector<rig::VertexPositions> results(examples.size());
  const std::size_t panels = (examples.size() + kExamplesPerPanel - 1) / kExamplesPerPanel;
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t p = next++; p < panels; p = next++) {
      const std::size_t first = p * kExamplesPerPanel, count = std::min(kExamplesPerPanel, examples.size() - first);
      s.solvePanel(examples.subspan(first, count), std::span(results).subspan(first, count));
    }
  };
  std::vector<std::jthread> helpers;
  for (int t = 1; t < s.threads && static_cast<std::size_t>(t) < panels; ++t) helpers.emplace_back(work);
  work();
  return results;
}

}  // namespace volto::transfer
