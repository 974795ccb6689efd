#include "rig/skin_rows.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "rig/multiquadric.h"

namespace volto::rig {
namespace {

double smoothStep(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

// Step 1.
class BlendedMultiquadrics {
 public:
  explicit BlendedMultiquadrics(const FeaturePointPositions& points) : regions_(regionsOfInfluence()) {
    for (std::size_t t = 0; t < kMaskTriangleCount; ++t) {
      rbf_[t] = Multiquadric(points, regions_.points[t]);
      side_[t] = slitSideOfTriangle(t);
    }
  }

  OperatorRow row(std::size_t triangle, const std::array<double, 3>& barycentric, const Eigen::Vector3d& at) const {
    std::array<double, kMaskTriangleCount> share{};
    double total = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& around = regions_.triangles_of_point[maskTriangles()[triangle][i]];
      std::size_t allowed = 0;
      for (const std::uint8_t t : around) allowed += opposite(side_[t], side_[triangle]) ? 0 : 1;
      for (const std::uint8_t t : around)
        if (!opposite(side_[t], side_[triangle])) share[t] += barycentric[i] / static_cast<double>(allowed);
      total += barycentric[i];
    }
    OperatorRow row{};
    for (std::size_t t = 0; t < kMaskTriangleCount; ++t)
      if (share[t] > 0) rbf_[t].addWeights(at, share[t] / total, row);
    return row;
  }

 private:
  RegionsOfInfluence regions_;
  std::array<Multiquadric, kMaskTriangleCount> rbf_;
  std::array<SlitSide, kMaskTriangleCount> side_{};
};

// Mean length of the mask's edges at each point.
std::array<double, kFeaturePointCount> maskEdgeLength(const FeaturePointPositions& points) {
  std::array<double, kFeaturePointCount> sum{}, count{};
  for (const MaskTriangle& t : maskTriangles())
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint8_t a = t[i], b = t[(i + 1) % 3];
      const double length = (points.row(a) - points.row(b)).norm();
      for (const std::uint8_t p : {a, b}) {
        sum[p] += length;
        count[p] += 1;
      }
    }
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) sum[p] /= std::max(count[p], 1.0);
  return sum;
}

// Step 2. Unknowns are the rows of the vertices within the fade; lengths are in eye separations.
class Fairing {
 public:
  Fairing(const Skin& skin, const SkinAssociation& association, double eye_separation)
      : skin_(skin), association_(association), es2_(eye_separation * eye_separation) {}

  void solve(SkinRows& out, const std::vector<double>& data_weight, const SkinPoints& on_skin) const {
    using Sparse = Eigen::SparseMatrix<double>;
    const auto unknowns = static_cast<Eigen::Index>(out.rows.size());
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::MatrixXd right = Eigen::MatrixXd::Zero(unknowns, static_cast<Eigen::Index>(kFeaturePointCount));

    // Sum over vertices v of |(L x)_v|^2 / area_v. A neighbour beyond the fade counts with zero rows.
    std::vector<std::pair<std::int32_t, double>> stencil;
    for (std::uint32_t v = 0; v < skin_.same_as.size(); ++v) {
      if (!skin_.stands(v) || !touches(out, v)) continue;
      stencil.clear();
      double diagonal = 0;
      for (std::uint32_t e = skin_.graph.start[v]; e < skin_.graph.start[v + 1]; ++e) {
        diagonal -= skin_.laplacian[e];
        if (const std::int32_t u = out.row_of_vertex[skin_.graph.neighbour[e]]; u >= 0)
          stencil.emplace_back(u, skin_.laplacian[e]);
      }
      if (out.row_of_vertex[v] >= 0) stencil.emplace_back(out.row_of_vertex[v], diagonal);
      const double scale = 1 / areaOf(v);
      for (const auto& [a, wa] : stencil)
        for (const auto& [b, wb] : stencil)
          if (a >= b) entries.emplace_back(a, b, scale * wa * wb);
    }
    for (std::uint32_t v = 0; v < skin_.same_as.size(); ++v) {
      const std::int32_t row = out.row_of_vertex[v];
      if (row < 0 || !skin_.stands(v)) continue;
      // A trace of weight everywhere keeps a piece of skin without any point solvable.
      const double weight = areaOf(v) * (data_weight[v] + 1e-9);
      entries.emplace_back(row, row, weight);
      for (std::size_t p = 0; p < kFeaturePointCount; ++p)
        right(row, static_cast<Eigen::Index>(p)) += weight * out.rows[static_cast<std::size_t>(row)][p];
    }
    for (std::size_t p = 0; p < kFeaturePointCount; ++p) addPoint(out, p, on_skin[p], entries, right);

    Sparse system(unknowns, unknowns);
    system.setFromTriplets(entries.begin(), entries.end());
    entries = {};
    const Eigen::SimplicialLDLT<Sparse, Eigen::Lower> solver(system);
    if (solver.info() != Eigen::Success) throw std::runtime_error("rigging: the skin's equations cannot be solved");
    const Eigen::MatrixXd solution = solver.solve(right);
    for (Eigen::Index row = 0; row < unknowns; ++row)
      for (std::size_t p = 0; p < kFeaturePointCount; ++p)
        out.rows[static_cast<std::size_t>(row)][p] = solution(row, static_cast<Eigen::Index>(p));
  }

 private:
  double areaOf(std::uint32_t v) const { return std::max(skin_.area[v] / es2_, 1e-9); }

  bool touches(const SkinRows& out, std::uint32_t v) const {
    if (out.row_of_vertex[v] >= 0) return true;
    for (std::uint32_t e = skin_.graph.start[v]; e < skin_.graph.start[v + 1]; ++e)
      if (out.row_of_vertex[skin_.graph.neighbour[e]] >= 0) return true;
    return false;
  }

  // Holds the skin at a feature point to that point, by a weight far above all others; the rows of points that are
  // vertices are set exactly afterwards.
  void addPoint(const SkinRows& out, std::size_t p, const SkinPoint& point,
                std::vector<Eigen::Triplet<double>>& entries, Eigen::MatrixXd& right) const {
    std::vector<std::pair<std::int32_t, double>> shares;
    for (std::size_t i = 0; i < point.around.size(); ++i)
      if (const std::int32_t row = out.row_of_vertex[point.around[i].vertex]; row >= 0)
        shares.emplace_back(row, point.weight[i]);
    if (shares.empty()) return;
    const double weight = 1e5 / areaOf(point.around.front().vertex);
    for (const auto& [a, wa] : shares) {
      for (const auto& [b, wb] : shares)
        if (a >= b) entries.emplace_back(a, b, weight * wa * wb);
      right(a, static_cast<Eigen::Index>(p)) += weight * wa;
    }
  }

  const Skin& skin_;
  const SkinAssociation& association_;
  double es2_;
};

// Step 3. A column of one side is led to zero towards the vertices of the opposite side: from the full weight where the
// column's own point is as near as the opposite side, to nothing there.
void separateSides(const Skin& skin, const SkinAssociation& association, SkinRows& out) {
  constexpr std::array<SlitSide, 6> kSides = {SlitSide::upper_lip,       SlitSide::lower_lip,
                                              SlitSide::left_upper_lid,  SlitSide::left_lower_lid,
                                              SlitSide::right_upper_lid, SlitSide::right_lower_lid};
  std::vector<double> sum_before(out.rows.size());
  for (std::size_t r = 0; r < out.rows.size(); ++r)
    for (const double w : out.rows[r]) sum_before[r] += w;
  for (const SlitSide side : kSides) {
    std::vector<GeodesicSource> others;
    for (std::uint32_t v = 0; v < skin.same_as.size(); ++v)
      if (skin.stands(v) && opposite(association.side[v], side)) others.push_back({v, 0.0F});
    if (others.empty()) continue;
    const std::vector<float> to_others = geodesicDistances(skin.graph, others).distance;
    for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
      if (slitSide(p) != side) continue;
      for (std::uint32_t v = 0; v < skin.same_as.size(); ++v) {
        if (out.row_of_vertex[v] < 0 || !(to_others[v] < kUnreached)) continue;
        const double own = association.point_distance(v, static_cast<Eigen::Index>(p));
        const double share = own < kUnreached ? to_others[v] / (to_others[v] + own + 1e-12) : 0.0;
        out.rows[static_cast<std::size_t>(out.row_of_vertex[v])][p] *= smoothStep(2 * share);
      }
    }
  }
  for (std::size_t r = 0; r < out.rows.size(); ++r) {
    double sum = 0;
    for (const double w : out.rows[r]) sum += w;
    if (sum > 0 && sum_before[r] > 0)
      for (double& w : out.rows[r]) w *= std::min(sum_before[r] / sum, 3.0);
  }
}

}  // namespace

SkinRows skinRows(const Mesh& mesh, const Skin& skin, const SkinAssociation& association,
                  const FeaturePointPositions& points, const SkinPoints& on_skin, double eye_separation,
                  double blend_width) {
  SkinRows out;
  out.row_of_vertex.assign(mesh.vertexCount(), -1);
  for (std::uint32_t v = 0; v < mesh.vertexCount(); ++v)
    if (skin.stands(v) && association.kind[v] != AssociationKind::outside) {
      out.row_of_vertex[v] = static_cast<std::int32_t>(out.rows.size());
      out.rows.emplace_back();
    }
  const BlendedMultiquadrics multiquadrics(points);
  const std::array<double, kFeaturePointCount> edge_length = maskEdgeLength(points);
  std::vector<double> data_weight(mesh.vertexCount(), 0.0);
  for (std::uint32_t v = 0; v < mesh.vertexCount(); ++v) {
    if (out.row_of_vertex[v] < 0 || !association.on_mask[v]) continue;
    const auto triangle = static_cast<std::size_t>(association.triangle[v]);
    const auto& barycentric = association.barycentric[v];
    out.rows[static_cast<std::size_t>(out.row_of_vertex[v])] =
        multiquadrics.row(triangle, barycentric, mesh.positions.row(v).transpose());
    double size = 0;
    for (std::size_t i = 0; i < 3; ++i) size += barycentric[i] * edge_length[maskTriangles()[triangle][i]];
    const double width = std::max(blend_width, 1e-3) * size / eye_separation;
    // The two terms balance at this wavelength: (2 pi / width)^4.
    data_weight[v] = std::pow(2 * 3.14159265358979 / width, 4);
  }
  Fairing(skin, association, eye_separation).solve(out, data_weight, on_skin);
  separateSides(skin, association, out);
  for (std::size_t p = 0; p < kFeaturePointCount; ++p)
    if (on_skin[p].isVertex() && out.row_of_vertex[on_skin[p].around.front().vertex] >= 0) {
      OperatorRow& row = out.rows[static_cast<std::size_t>(out.row_of_vertex[on_skin[p].around.front().vertex])];
      row.fill(0.0);
      row[p] = 1.0;
    }
  for (OperatorRow& row : out.rows) dropSmallWeights(row);
  for (std::uint32_t v = 0; v < mesh.vertexCount(); ++v) out.row_of_vertex[v] = out.row_of_vertex[skin.same_as[v]];
  return out;
}

void dropSmallWeights(OperatorRow& row) {
  double before = 0, after = 0;
  for (double& w : row) {
    before += w;
    w *= smoothStep((std::abs(w) - 1e-3) / 3e-3);
    after += w;
  }
  if (before > 0 && after > 0)
    for (double& w : row) w *= std::min(before / after, 2.0);
}

}  // namespace volto::rig
