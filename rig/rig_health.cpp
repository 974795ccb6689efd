#include "rig/rig_health.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "rig/geodesic.h"
#include "rig/multiquadric.h"

namespace volto::rig {
namespace {

EdgeGraph edgesOf(const Mesh& mesh) {
  std::vector<std::uint32_t> same(mesh.vertexCount());
  for (std::uint32_t v = 0; v < same.size(); ++v) same[v] = v;
  return buildEdgeGraph(mesh, mesh, same);
}

VertexPositions displaced(const Rig& rig, const Blendshape& shape) {
  VertexPositions out = VertexPositions::Zero(rig.neutral.positions.rows(), 3);
  const DeformationOperator& op = rig.deformation;
  for (std::size_t v = 0; v < op.vertexCount(); ++v)
    for (std::uint32_t e = op.row_start[v]; e < op.row_start[v + 1]; ++e) {
      const auto& d = shape.mask_displacement[op.point[e]];
      out.row(static_cast<Eigen::Index>(v)) += op.weight[e] * Eigen::RowVector3d(d[0], d[1], d[2]);
    }
  return out;
}

// What one side of an edge across a border says about the middle of the edge: a plane through the values of the vertices
// next to the edge's end that are of the end's own triangle, least squares in the surface's tangent.
class Jumps {
 public:
  Jumps(const Mesh& mesh, const EdgeGraph& graph, const std::vector<std::int16_t>& triangle) : mesh_(mesh), graph_(graph) {
    const VertexPositions normals = normalsOf(mesh);
    for (std::uint32_t a = 0; a < triangle.size(); ++a) {
      if (triangle[a] < 0) continue;
      for (std::uint32_t e = graph.start[a]; e < graph.start[a + 1]; ++e) {
        const std::uint32_t b = graph.neighbour[e];
        if (b <= a || triangle[b] < 0 || triangle[a] == triangle[b]) continue;
        Edge edge;
        if (extrapolate(a, b, triangle, normals, edge.first) && extrapolate(b, a, triangle, normals, edge.second))
          edges_.push_back(std::move(edge));
      }
    }
  }

  void add(const VertexPositions& d, BorderJump& sum) const {
    for (const Edge& edge : edges_) {
      const Eigen::RowVector3d one = valueOf(edge.first, d), other = valueOf(edge.second, d);
      sum.jump += (one - other).squaredNorm();
      sum.displacement += 0.5 * (one.squaredNorm() + other.squaredNorm());
      ++sum.edges;
    }
  }

 private:
  using Row = std::vector<std::pair<std::uint32_t, double>>;  // weights of vertices
  struct Edge {
    Row first, second;
  };

  static VertexPositions normalsOf(const Mesh& mesh) {
    VertexPositions out = VertexPositions::Zero(mesh.positions.rows(), 3);
    for (const auto& [a, b, c] : triangulate(mesh)) {
      const Eigen::RowVector3d normal = Eigen::RowVector3d(mesh.positions.row(b) - mesh.positions.row(a))
                                            .cross(Eigen::RowVector3d(mesh.positions.row(c) - mesh.positions.row(a)));
      for (const std::uint32_t v : {a, b, c}) out.row(v) += normal;
    }
    return out;
  }

  // False where the vertices at hand do not say (too few, in one line, all on one side): nothing is better than an
  // extrapolation that multiplies every unevenness.
  bool extrapolate(std::uint32_t end, std::uint32_t other, const std::vector<std::int16_t>& triangle,
                   const VertexPositions& normals, Row& out) const {
    constexpr double kMostGain = 2.5;
    const Eigen::Vector3d normal = (normals.row(end).normalized() + normals.row(other).normalized()).normalized();
    const Eigen::Vector3d middle = 0.5 * (mesh_.positions.row(end) + mesh_.positions.row(other));
    Eigen::Vector3d along = mesh_.positions.row(other) - mesh_.positions.row(end);
    along = (along - along.dot(normal) * normal).normalized();
    const Eigen::Vector3d across = normal.cross(along);
    if (!normal.allFinite() || !along.allFinite()) return false;
    const auto take = [&](std::uint32_t v) { out.emplace_back(v, 0.0); };
    take(end);
    for (std::uint32_t e = graph_.start[end]; e < graph_.start[end + 1]; ++e)
      if (triangle[graph_.neighbour[e]] == triangle[end] && normal.dot(normals.row(graph_.neighbour[e])) > 0)
        take(graph_.neighbour[e]);
    if (out.size() < 4) return false;
    const auto rows = static_cast<Eigen::Index>(out.size());
    Eigen::MatrixXd plane(rows, 3);
    double size = 0;
    for (Eigen::Index i = 0; i < rows; ++i) {
      const Eigen::Vector3d offset = mesh_.positions.row(out[static_cast<std::size_t>(i)].first).transpose() - middle;
      plane.row(i) << 1, offset.dot(along), offset.dot(across);
      size += offset.squaredNorm();
    }
    size = std::sqrt(size / static_cast<double>(rows));
    if (!(size > 0)) return false;
    plane.rightCols<2>() /= size;
    Eigen::VectorXd near(rows);
    for (Eigen::Index i = 0; i < rows; ++i) near[i] = std::exp(-0.5 * plane.row(i).tail<2>().squaredNorm());
    const Eigen::MatrixXd weighted = near.asDiagonal() * plane;
    const Eigen::Matrix3d normal_matrix = weighted.transpose() * weighted;
    const Eigen::FullPivLU<Eigen::Matrix3d> solver(normal_matrix);
    if (solver.rank() < 3) return false;
    const Eigen::RowVectorXd row = solver.solve(Eigen::Vector3d(1, 0, 0)).transpose() * weighted.transpose() * near.asDiagonal();
    if (!(row.norm() < kMostGain)) return false;
    for (Eigen::Index i = 0; i < rows; ++i) out[static_cast<std::size_t>(i)].second = row[i];
    return true;
  }

  static Eigen::RowVector3d valueOf(const Row& row, const VertexPositions& d) {
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    for (const auto& [v, weight] : row) sum += weight * d.row(v);
    return sum;
  }

  const Mesh& mesh_;
  const EdgeGraph& graph_;
  std::vector<Edge> edges_;
};

void finish(BorderJump& sum) {
  const double edges = std::max<double>(1, static_cast<double>(sum.edges));
  sum.jump = std::sqrt(sum.jump / edges);
  sum.displacement = std::sqrt(sum.displacement / edges);
}

// Triangles of the mask on skin that its normal met, -1 elsewhere.
std::vector<std::int16_t> byRay(const Rig& rig) {
  std::vector<std::int16_t> out = rig.association.triangle;
  for (std::size_t v = 0; v < out.size(); ++v)
    if (rig.association.kind[v] != AssociationKind::ray) out[v] = -1;
  return out;
}

void findTornAndDoubtful(const Rig& rig, const EdgeGraph& graph, RigHealth& out) {
  const DeformationOperator& op = rig.deformation;
  const auto sum = [&op](std::uint32_t v) {
    double total = 0;
    for (std::uint32_t e = op.row_start[v]; e < op.row_start[v + 1]; ++e) total += op.weight[e];
    return total;
  };
  const std::vector<std::int16_t> triangle = byRay(rig);
  const auto triangles = maskTriangles();
  for (std::uint32_t v = 0; v < graph.vertexCount(); ++v) {
    const bool stays = op.row_start[v] == op.row_start[v + 1] && rig.association.kind[v] != AssociationKind::rigid_part;
    bool torn = false, doubtful = false;
    for (std::uint32_t e = graph.start[v]; e < graph.start[v + 1]; ++e) {
      const std::uint32_t u = graph.neighbour[e];
      torn |= stays && sum(u) > 0.33;
      if (triangle[v] < 0 || triangle[u] < 0) continue;
      const auto& a = triangles[static_cast<std::size_t>(triangle[v])];
      const auto& b = triangles[static_cast<std::size_t>(triangle[u])];
      const bool common = std::any_of(a.begin(), a.end(), [&b](auto p) { return std::find(b.begin(), b.end(), p) != b.end(); });
      if (common) continue;
      double shortest = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < 3; ++i)
        shortest = std::min(shortest, (rig.feature_positions.row(a[i]) - rig.feature_positions.row(a[(i + 1) % 3])).norm());
      doubtful |= graph.length[e] < 0.5 * shortest;
    }
    if (torn) out.torn.push_back(v);
    if (doubtful) out.doubtful.push_back(v);
  }
}

std::string counted(std::size_t n, const char* one, const char* many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

}  // namespace

BorderJump borderJump(const Mesh& mesh, const std::vector<std::int16_t>& triangle, const VertexPositions& displacement) {
  const EdgeGraph graph = edgesOf(mesh);
  BorderJump out;
  Jumps(mesh, graph, triangle).add(displacement, out);
  finish(out);
  return out;
}

RigHealth inspectRig(const Rig& rig) {
  RigHealth out;
  for (const AssociationKind kind : rig.association.kind) ++out.vertices[static_cast<std::size_t>(kind)];
  const EdgeGraph graph = edgesOf(rig.neutral);
  findTornAndDoubtful(rig, graph, out);

  for (const std::int16_t t : rig.association.triangle)
    if (t >= 0) ++out.regions[static_cast<std::size_t>(t)].vertices;
  const VertexPositions points = rig.feature_positions;
  for (std::size_t t = 0; t < kMaskTriangleCount; ++t) {
    RegionHealth& region = out.regions[t];
    const std::vector<std::uint16_t> of(rig.region_of_influence[t].begin(), rig.region_of_influence[t].end());
    region.control_points = of.size();
    region.condition = Multiquadric(points, of).condition();
    if (region.condition > out.regions[out.worst_condition].condition) out.worst_condition = t;
    if (region.vertices == 0) out.empty_regions.push_back(static_cast<std::uint8_t>(t));
  }
  for (std::size_t p = 0; p < kFeaturePointCount; ++p)
    for (std::size_t q = 0; q < p; ++q)
      if (rig.feature_vertex[p] >= 0 && rig.feature_vertex[p] == rig.feature_vertex[q])
        out.shared_points.push_back(std::string(featurePoints()[q].id) + " " + std::string(featurePoints()[p].id));

  const std::vector<std::int16_t> triangle = byRay(rig);
  const Jumps jumps(rig.neutral, graph, triangle);
  for (const Blendshape& shape : rig.blendshapes)
    if (shape.moves_mask) jumps.add(displaced(rig, shape), out.smoothness);
  finish(out.smoothness);

  for (const std::string& line : rig.fapu.substitutions) out.problems.push_back(line);
  if (!out.shared_points.empty())
    out.problems.push_back("the two sides of a mouth or an eye are one vertex at " + counted(out.shared_points.size(), "place", "places") +
                           " (" + out.shared_points.front() + (out.shared_points.size() > 1 ? ", ..." : "") +
                           "): it cannot open there; cut the mesh along it, or give the sides points of their own");
  if (!out.torn.empty())
    out.problems.push_back(counted(out.torn.size(), "vertex", "vertices") + " of the skin stay while a neighbour moves (first " +
                           std::to_string(out.torn.front()) + "): a tear may open there");
  if (out.doubtful.size() * 200 > rig.neutral.vertexCount())
    out.problems.push_back(counted(out.doubtful.size(), "vertex", "vertices") +
                           " may be associated with the wrong triangle of the mask (first " + std::to_string(out.doubtful.front()) +
                           "): look at the picture, and at the points around there");
  if (out.empty_regions.size() > 40)
    out.problems.push_back(std::to_string(out.empty_regions.size()) +
                           " of 136 triangles of the mask have no vertex: the mesh is coarser than the mask, or points are misplaced");
  if (!(out.regions[out.worst_condition].condition < 1e9)) {
    const auto& t = maskTriangles()[out.worst_condition];
    out.problems.push_back("control points around " + std::string(featurePoints()[t[0]].id) + " " +
                           std::string(featurePoints()[t[1]].id) + " " + std::string(featurePoints()[t[2]].id) +
                           " are nearly in one place: that region's system is close to singular");
  }
  return out;
}

}  // namespace volto::rig
