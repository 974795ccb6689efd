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

class Jumps {
 public:
  Jumps(const Mesh& mesh, const EdgeGraph& graph, const std::vector<std::int16_t>& triangle)
      : mesh_(mesh), graph_(graph), triangle_(triangle), inverse_(mesh.vertexCount()), usable_(mesh.vertexCount(), false) {
    for (std::uint32_t v = 0; v < triangle.size(); ++v) {
      if (triangle[v] < 0) continue;
      Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
      int neighbours = 0;
      for (std::uint32_t e = graph.start[v]; e < graph.start[v + 1]; ++e) {
        if (triangle[graph.neighbour[e]] != triangle[v]) continue;
        const Eigen::Vector3d dx = offset(v, graph.neighbour[e]);
        spread += dx * dx.transpose();
        ++neighbours;
      }
      const double size = spread.trace();
      // Across the normal nothing is known; along two directions of the surface something must be.
      const double flat = 0.5 * (size * size - spread.squaredNorm());  // sum of products of two eigenvalues
      if (neighbours < 3 || !(flat > 1e-3 * size * size)) continue;
      spread.diagonal().array() += 1e-6 * size;
      inverse_[v] = spread.inverse();
      usable_[v] = true;
    }
  }

  void add(const VertexPositions& d, BorderJump& sum) const {
    double jump2 = sum.jump, displacement2 = sum.displacement;
    for (std::uint32_t a = 0; a < triangle_.size(); ++a) {
      if (!usable_[a]) continue;
      const Eigen::Matrix3d gradient_a = gradient(a, d);
      for (std::uint32_t e = graph_.start[a]; e < graph_.start[a + 1]; ++e) {
        const std::uint32_t b = graph_.neighbour[e];
        if (b <= a || !usable_[b] || triangle_[a] == triangle_[b]) continue;
        const Eigen::Vector3d change = (d.row(b) - d.row(a)).transpose();
        jump2 += (change - 0.5 * (gradient_a + gradient(b, d)) * offset(a, b)).squaredNorm();
        displacement2 += 0.5 * (d.row(a).squaredNorm() + d.row(b).squaredNorm());
        ++sum.edges;
      }
    }
    sum.jump = jump2;
    sum.displacement = displacement2;
  }

 private:
  Eigen::Vector3d offset(std::uint32_t a, std::uint32_t b) const {
    return (mesh_.positions.row(b) - mesh_.positions.row(a)).transpose();
  }
  Eigen::Matrix3d gradient(std::uint32_t v, const VertexPositions& d) const {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (std::uint32_t e = graph_.start[v]; e < graph_.start[v + 1]; ++e)
      if (const std::uint32_t u = graph_.neighbour[e]; triangle_[u] == triangle_[v])
        sum += (d.row(u) - d.row(v)).transpose() * offset(v, u).transpose();
    return sum * inverse_[v];
  }

  const Mesh& mesh_;
  const EdgeGraph& graph_;
  const std::vector<std::int16_t>& triangle_;
  std::vector<Eigen::Matrix3d> inverse_;
  std::vector<bool> usable_;
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
