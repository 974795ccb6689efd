#include "rig/skin_rows.h"

#include <algorithm>
#include <cmath>

#include "rig/multiquadric.h"
#include "rig/parallel.h"

namespace volto::rig {
namespace {

constexpr Eigen::Index kPanel = 42;  // columns that are solved together
constexpr float kNegligible = 1e-5F;

double smoothStep(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

// Step 1.
class BlendedMultiquadrics {
 public:
  BlendedMultiquadrics(const MaskGeometry& mask, const RegionEdits& edits)
      : mask_(mask), regions_(regionsOfInfluence(mask, edits)), rbf_(kMaskTriangleCount), side_(kMaskTriangleCount) {
    parallelFor(kMaskTriangleCount, [&](std::size_t t) {
      const auto stiffness = edits.stiffness.find(static_cast<std::uint8_t>(t));
      rbf_[t] =
          Multiquadric(mask.points, regions_.points[t], stiffness == edits.stiffness.end() ? 1 : stiffness->second);
      side_[t] = slitSideOfTriangle(t);
    });
  }

  void addRow(std::size_t triangle, const std::array<double, 3>& barycentric, const Eigen::Vector3d& at,
              RowBuilder& row, Eigen::RowVectorXd& weights) const {
    std::array<double, kMaskTriangleCount> share{};
    double total = 0;
    const SlitSide side = mask_.triangle_side[triangle];
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& around = regions_.triangles_of_point[mask_.triangles[triangle][i]];
      std::size_t allowed = 0;
      for (const std::uint8_t t : around) allowed += opposite(side_[t], side) ? 0 : 1;
      for (const std::uint8_t t : around)
        if (!opposite(side_[t], side)) share[t] += barycentric[i] / static_cast<double>(allowed);
      total += barycentric[i];
    }
    for (std::size_t t = 0; t < kMaskTriangleCount; ++t) {
      if (!(share[t] > 0)) continue;
      rbf_[t].weightsAt(at, weights);
      const auto points = rbf_[t].points();
      for (std::size_t j = 0; j < points.size(); ++j)
        row.add(points[j], share[t] / total * weights[static_cast<Eigen::Index>(j)]);
    }
  }

 private:
  const MaskGeometry& mask_;
  RegionsOfInfluence regions_;
  std::vector<Multiquadric> rbf_;
  std::vector<SlitSide> side_;
};

// Mean length of the mask's edges at each point.
std::vector<double> maskEdgeLength(const MaskGeometry& mask) {
  std::vector<double> sum(mask.pointCount()), count(mask.pointCount());
  for (const MaskGeometry::Triangle& t : mask.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint16_t a = t[i], b = t[(i + 1) % 3];
      const double length = (mask.points.row(a) - mask.points.row(b)).norm();
      for (const std::uint16_t p : {a, b}) {
        sum[p] += length;
        count[p] += 1;
      }
    }
  for (std::size_t p = 0; p < sum.size(); ++p) sum[p] /= std::max(count[p], 1.0);
  return sum;
}

}  // namespace

MaskOnSkin controlMaskOnSkin(const SkinProblem& problem, MaskGeometry geometry) {
  MaskOnSkin out{std::move(geometry), problem.feature_points, {}, problem.association.barycentric};
  out.triangle.assign(problem.mesh.vertexCount(), -1);
  for (std::size_t v = 0; v < out.triangle.size(); ++v)
    if (problem.association.on_mask[v]) out.triangle[v] = problem.association.triangle[v];
  return out;
}

struct SkinInterpolation::State {
  const SkinProblem& problem;
  const MaskOnSkin& mask;
  std::vector<std::int32_t> unknown;  // #V
  std::vector<std::uint32_t> vertex;  // of each unknown
  SparseRows blended;                 // step 1, per unknown; empty where there is no ray
  std::unique_ptr<SkinEquations> equations;

  std::vector<double> fade;  // step 4, per unknown

  std::array<std::vector<float>, 7> to_opposite;  // step 3, per vertex

  void blend();
  void makeFade();
  // Distance along the skin from the side opposite to each, per vertex; empty where nothing is there.
  std::array<std::vector<float>, 7> toOppositeSide() const;
  double pointDistance(std::uint32_t v, std::size_t p) const;
};

SkinInterpolation::SkinInterpolation(const SkinProblem& problem, const MaskOnSkin& mask)
    : state_(new State{problem, mask, {}, {}, {}, nullptr, {}, {}}) {
  State& s = *state_;
  const auto vertices = static_cast<std::uint32_t>(problem.mesh.vertexCount());
  s.unknown.assign(vertices, -1);
  for (std::uint32_t v = 0; v < vertices; ++v)
    if (problem.skin.stands(v) && problem.association.kind[v] != AssociationKind::outside) {
      s.unknown[v] = static_cast<std::int32_t>(s.vertex.size());
      s.vertex.push_back(v);
    }
  const std::vector<double> edge_length = maskEdgeLength(mask.geometry);
  std::vector<double> data_weight(s.vertex.size(), 0.0);
  for (std::size_t i = 0; i < s.vertex.size(); ++i) {
    const std::int32_t triangle = mask.triangle[s.vertex[i]];
    if (triangle < 0) continue;
    double size = 0;
    for (std::size_t k = 0; k < 3; ++k)
      size += mask.barycentric[s.vertex[i]][k] *
              edge_length[mask.geometry.triangles[static_cast<std::size_t>(triangle)][k]];
    const double width = std::max(problem.blend_width, 1e-3) * size / problem.eye_separation;
    // The two terms balance at this wavelength: (2 pi / width)^4.
    data_weight[i] = std::pow(2 * 3.14159265358979 / width, 4);
  }
  // The factorisation, which takes longest and is one thread's work, beside all that does not need it.
  parallelFor(2, [&](std::size_t which) {
    if (which == 0) {
      s.equations = std::make_unique<SkinEquations>(problem.skin, s.unknown, data_weight, mask.points, problem.lining,
                                                    problem.eye_separation);
    } else {
      s.blend();
      s.makeFade();
      s.to_opposite = s.toOppositeSide();
    }
  });
}

// Step 1, in chunks of vertices, put together in order.
void SkinInterpolation::State::blend() {
  const BlendedMultiquadrics multiquadrics(mask.geometry, problem.edits);
  constexpr std::size_t kChunk = 1024;
  std::vector<SparseRows> chunks((vertex.size() + kChunk - 1) / kChunk);
  parallelFor(chunks.size(), [&](std::size_t chunk) {
    RowBuilder row(mask.geometry.pointCount());
    Eigen::RowVectorXd weights;
    for (std::size_t i = chunk * kChunk; i < std::min((chunk + 1) * kChunk, vertex.size()); ++i) {
      const std::uint32_t v = vertex[i];
      if (mask.triangle[v] >= 0)
        multiquadrics.addRow(static_cast<std::size_t>(mask.triangle[v]), mask.barycentric[v],
                             problem.mesh.positions.row(v).transpose(), row, weights);
      row.finish(chunks[chunk]);
    }
  });
  for (SparseRows& chunk : chunks) {
    for (std::size_t r = 0; r < chunk.size(); ++r) blended.start.push_back(blended.point.size() + chunk.start[r + 1]);
    blended.point.insert(blended.point.end(), chunk.point.begin(), chunk.point.end());
    blended.weight.insert(blended.weight.end(), chunk.weight.begin(), chunk.weight.end());
    chunk = {};
  }
}

SkinInterpolation::~SkinInterpolation() = default;

// 1 on the mask, 0 where the skin stays, in between by how near each is; flat at both ends. A lining fades with the
// skin in front of it.
void SkinInterpolation::State::makeFade() {
  std::vector<GeodesicSource> still;
  for (std::uint32_t v = 0; v < unknown.size(); ++v)
    if (problem.skin.stands(v) && unknown[v] < 0) still.push_back({v, 0.0F});
  // Rest begins somewhere along the edges to such vertices.
  const EdgeGraph& graph = problem.skin.graph;
  for (const std::uint32_t v : vertex)
    for (std::uint32_t e = graph.start[v]; e < graph.start[v + 1]; ++e)
      if (unknown[graph.neighbour[e]] < 0)
        still.push_back(
            {v, std::clamp(problem.association.fade_out - problem.association.beyond[v], 0.0F, graph.length[e])});
  const std::vector<float> to_still = surfaceDistances(problem.skin.graph, still).distance;
  fade.reserve(vertex.size());
  for (const std::uint32_t v : vertex) {
    const double beyond = problem.association.beyond[v], left = to_still[v];
    fade.push_back(left < kUnreached ? std::pow(smoothStep(left / (left + beyond + 1e-12)), 2) : 1.0);
  }
  const std::vector<double> alone = fade;
  for (const SkinTie& tie : problem.lining) {
    double front = 0;
    for (std::size_t k = 0; k < 3; ++k)
      if (const std::int32_t u = unknown[tie.to[k]]; u >= 0)
        front += tie.weight[k] * alone[static_cast<std::size_t>(u)];
    double& own = fade[static_cast<std::size_t>(unknown[tie.vertex])];
    own += tie.share * (front - own);
  }
}

Columns SkinInterpolation::displace(const Columns& points) const {
  const State& s = *state_;
  const Eigen::Index panels = (points.cols() + kPanel - 1) / kPanel;
  Columns out = Columns::Zero(static_cast<Eigen::Index>(s.unknown.size()), points.cols());
  parallelFor(static_cast<std::size_t>(panels), [&](std::size_t panel) {
    const Eigen::Index first = static_cast<Eigen::Index>(panel) * kPanel;
    const Eigen::Index width = std::min(kPanel, points.cols() - first);
    const Columns values = points.middleCols(first, width);
    Columns x = Columns::Zero(static_cast<Eigen::Index>(s.vertex.size()), width);
    for (std::size_t i = 0; i < s.vertex.size(); ++i)
      for (std::size_t e = s.blended.start[i]; e < s.blended.start[i + 1]; ++e)
        x.row(static_cast<Eigen::Index>(i)) += s.blended.weight[e] * values.row(s.blended.point[e]);
    s.equations->solve(values, x);
    for (std::size_t i = 0; i < s.vertex.size(); ++i)
      out.block(s.vertex[i], first, 1, width) = s.fade[i] * x.row(static_cast<Eigen::Index>(i));
    for (std::size_t p = 0; p < s.mask.points.size(); ++p)
      if (s.mask.points[p].isVertex())
        out.block(s.mask.points[p].around.front().vertex, first, 1, width) = values.row(static_cast<Eigen::Index>(p));
  });
  for (std::size_t v = 0; v < s.unknown.size(); ++v)
    if (!s.problem.skin.stands(static_cast<std::uint32_t>(v)))
      out.row(static_cast<Eigen::Index>(v)) = out.row(s.problem.skin.same_as[v]);
  return out;
}

// From the skin that the mask itself covers: what only lies near to it (the inside of the mouth) has no side of its
// own, or its two halves would part at a line that depends on how the mesh is cut.
std::array<std::vector<float>, 7> SkinInterpolation::State::toOppositeSide() const {
  std::array<std::vector<float>, 7> out;
  // Where the opposite side is farther than a point, the point has its full weight (step 3).
  const double across = (mask.geometry.points.colwise().maxCoeff() - mask.geometry.points.colwise().minCoeff()).norm();
  const float limit = mask.points.size() > kFeaturePointCount
                          ? std::max(problem.association.reach, static_cast<float>(2 * across))
                          : problem.association.reach;
  parallelFor(6, [&](std::size_t k) {
    const auto side = static_cast<SlitSide>(k + 1);
    std::vector<GeodesicSource> others;
    for (std::uint32_t v = 0; v < problem.skin.same_as.size(); ++v)
      if (problem.skin.stands(v) && problem.association.on_mask[v] && opposite(problem.association.side[v], side))
        others.push_back({v, 0.0F});
    for (const SkinBorder& border : problem.association.borders)
      if (opposite(problem.association.side[border.inside], side)) others.push_back({border.outside, border.left()});
    for (std::size_t p = 0; p < kFeaturePointCount; ++p)
      if (opposite(slitSide(p), side))
        others.insert(others.end(), problem.feature_points[p].around.begin(), problem.feature_points[p].around.end());
    if (!others.empty()) out[k + 1] = surfaceDistances(problem.skin.graph, others, limit).distance;
  });
  return out;
}

// Along the skin for the feature points; through the air for those that were added, which lie between them.
double SkinInterpolation::State::pointDistance(std::uint32_t v, std::size_t p) const {
  if (p >= kFeaturePointCount)
    return (problem.mesh.positions.row(v) - mask.geometry.points.row(static_cast<Eigen::Index>(p))).norm();
  return std::min(problem.association.point_distance(v, static_cast<Eigen::Index>(p)), problem.association.reach);
}

SkinRows SkinInterpolation::rows() const {
  const State& s = *state_;
  const std::size_t unknowns = s.vertex.size(), points = s.mask.geometry.pointCount();

  struct Panel {
    std::vector<std::size_t> start{0};
    std::vector<std::uint16_t> point;
    std::vector<float> weight;
  };
  std::vector<Panel> panels((points + kPanel - 1) / static_cast<std::size_t>(kPanel));
  parallelFor(panels.size(), [&](std::size_t k) {
    const std::size_t first = k * static_cast<std::size_t>(kPanel);
    const std::size_t last = std::min(first + static_cast<std::size_t>(kPanel), points);
    const auto width = static_cast<Eigen::Index>(last - first);
    Columns values = Columns::Zero(static_cast<Eigen::Index>(points), width);
    for (std::size_t p = first; p < last; ++p)
      values(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(p - first)) = 1;
    Columns x = Columns::Zero(static_cast<Eigen::Index>(unknowns), width);
    for (std::size_t i = 0; i < unknowns; ++i)
      for (std::size_t e = s.blended.start[i]; e < s.blended.start[i + 1]; ++e)
        if (const std::size_t p = s.blended.point[e]; p >= first && p < last)
          x(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(p - first)) = s.blended.weight[e];
    s.equations->solve(values, x);

    Panel& out = panels[k];
    for (std::size_t i = 0; i < unknowns; ++i) {
      for (std::size_t p = first; p < last; ++p) {
        double w = x(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(p - first));
        if (!(std::abs(w) > kNegligible)) continue;
        // Step 3: a column of one side is led to zero towards the opposite side, from the full weight where the
        // column's own point is as near as the opposite side, to nothing there.
        const auto& others = s.to_opposite[static_cast<std::size_t>(s.mask.geometry.point_side[p])];
        if (!others.empty() && others[s.vertex[i]] < kUnreached) {
          const double other = others[s.vertex[i]];
          w *= smoothStep(2 * other / (other + s.pointDistance(s.vertex[i], p) + 1e-12));
        }
        if (!(std::abs(w) > kNegligible)) continue;
        out.point.push_back(static_cast<std::uint16_t>(p));
        out.weight.push_back(static_cast<float>(w));
      }
      out.start.push_back(out.point.size());
    }
  });

  // Points that are vertices move with themselves alone; where lips or lids share a vertex, it goes half way with each.
  std::vector<std::int32_t> held_by(s.unknown.size(), -1);
  std::vector<std::vector<std::uint16_t>> sharing;
  for (std::size_t p = 0; p < points; ++p) {
    if (!s.mask.points[p].isVertex()) continue;
    std::int32_t& slot = held_by[s.mask.points[p].around.front().vertex];
    if (slot < 0) {
      slot = static_cast<std::int32_t>(sharing.size());
      sharing.emplace_back();
    }
    sharing[static_cast<std::size_t>(slot)].push_back(static_cast<std::uint16_t>(p));
  }

  SkinRows out;
  out.row_of_vertex.assign(s.unknown.size(), -1);
  RowBuilder row(points);
  for (std::size_t i = 0; i < unknowns; ++i) {
    const std::uint32_t v = s.vertex[i];
    if (held_by[v] >= 0) {
      const auto& of = sharing[static_cast<std::size_t>(held_by[v])];
      for (const std::uint16_t p : of) row.add(p, 1.0 / static_cast<double>(of.size()));
    } else {
      for (const Panel& panel : panels)
        for (std::size_t e = panel.start[i]; e < panel.start[i + 1]; ++e) row.add(panel.point[e], panel.weight[e]);
      if (const double sum = row.sum(); sum > 0) row.scale(s.fade[i] * std::min(1 / sum, 3.0));
      row.dropSmall();
      if (!row.moves()) {  // so far out that nothing is left
        row.clear();
        continue;
      }
    }
    out.set(v, row);
  }
  // A vertex on another polygon's edge stays on that edge, or the crack would show.
  for (const TVertex& t : s.problem.t_vertices) {
    if (s.unknown[t.vertex] < 0 || held_by[t.vertex] >= 0) continue;
    for (const auto& [end, share] : {std::pair{t.a, 1 - t.share}, std::pair{t.b, t.share}})
      if (out.moves(end)) row.addRow(out.rows, static_cast<std::size_t>(out.row_of_vertex[end]), share);
    out.set(t.vertex, row);
  }
  for (std::uint32_t v = 0; v < s.unknown.size(); ++v)
    out.row_of_vertex[v] = out.row_of_vertex[s.problem.skin.same_as[v]];
  return out;
}

}  // namespace volto::rig
