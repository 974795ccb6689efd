#include "rig/skin.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace volto::rig {
namespace {

// Position of the edge a -> b in the graph's arrays.
std::size_t edgeIndex(const EdgeGraph& graph, std::uint32_t a, std::uint32_t b) {
  const auto first = graph.neighbour.begin() + graph.start[a], last = graph.neighbour.begin() + graph.start[a + 1];
  const auto found = std::lower_bound(first, last, b);
  return found != last && *found == b ? static_cast<std::size_t>(found - graph.neighbour.begin())
                                      : graph.neighbour.size();
}

// A triangle that is nearly a line has angles of 0 and 180 degrees and cotangents without bounds. Its sides are taken
// as this part of their mean longer, by which all of them keep the order of length, and the triangle keeps energies
// that are never negative (Sharp and Crane, "A Laplacian for Nonmanifold Triangle Meshes", section 4.5).
constexpr double kLeastSlack = 0.01;

class LaplaceAssembly {
 public:
  LaplaceAssembly(const Mesh& mesh, Skin& skin) : mesh_(mesh), skin_(skin) {}

  void addTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, double share) {
    if (a == b || b == c || c == a) return;
    const Eigen::Vector3d pa = mesh_.positions.row(a), pb = mesh_.positions.row(b), pc = mesh_.positions.row(c);
    const Eigen::Vector3d cross = (pb - pa).cross(pc - pa);
    for (const std::uint32_t v : {a, b, c}) {
      skin_.normals.row(v) += share * cross.transpose();
      skin_.area[v] += share * cross.norm() / 6;
    }
    std::array<double, 3> side{(pc - pb).norm(), (pa - pc).norm(), (pb - pa).norm()};  // opposite to each corner
    const double sum = side[0] + side[1] + side[2], longest = *std::max_element(side.begin(), side.end());
    if (!(sum > 0)) return;
    const double missing = kLeastSlack * sum / 3 - (sum - 2 * longest);
    for (double& s : side) s += std::max(missing, 0.0);
    const double half = 0.5 * (side[0] + side[1] + side[2]);
    const double area = std::sqrt(half * (half - side[0]) * (half - side[1]) * (half - side[2]));
    if (!(area > 0)) return;
    CotangentTriangle triangle{{a, b, c}, {}};
    for (std::size_t i = 0; i < 3; ++i) {
      const double own = side[i] * side[i], next = side[(i + 1) % 3] * side[(i + 1) % 3],
                   last = side[(i + 2) % 3] * side[(i + 2) % 3];
      triangle.weight[i] = share * (next + last - own) / (8 * area);
      addEdge(triangle.vertices[(i + 1) % 3], triangle.vertices[(i + 2) % 3], triangle.weight[i]);
    }
    skin_.cotangents.push_back(triangle);
  }

 private:
  void addEdge(std::uint32_t a, std::uint32_t b, double weight) {
    const std::size_t ab = edgeIndex(skin_.graph, a, b), ba = edgeIndex(skin_.graph, b, a);
    if (ab >= skin_.laplacian.size() || ba >= skin_.laplacian.size()) return;
    skin_.laplacian[ab] += weight;
    skin_.laplacian[ba] += weight;
  }
  const Mesh& mesh_;
  Skin& skin_;
};

}  // namespace

Skin prepareSkin(const Mesh& mesh, const Mesh& polygons, std::vector<std::uint32_t> same_as) {
  Skin skin;
  skin.same_as = std::move(same_as);
  skin.graph = buildEdgeGraph(mesh, polygons, skin.same_as);
  const std::size_t vertices = mesh.vertexCount();
  skin.normals = VertexPositions::Zero(mesh.positions.rows(), 3);
  skin.area.assign(vertices, 0.0);
  skin.laplacian.assign(skin.graph.neighbour.size(), 0.0);

  LaplaceAssembly assembly(mesh, skin);
  for (std::size_t p = 0; p < polygons.polygonCount(); ++p) {
    const std::uint32_t first = polygons.polygon_start[p];
    const std::uint32_t corners = polygons.polygon_start[p + 1] - first;
    const auto corner = [&](std::uint32_t c) { return skin.same_as[polygons.corner_vertices[first + c % corners]]; };
    if (corners == 4) {
      for (std::uint32_t c = 0; c < 4; ++c) assembly.addTriangle(corner(c), corner(c + 1), corner(c + 2), 0.5);
    } else if (corners <= kMostCornersCutAllWays) {
      for (std::uint32_t apex = 0; apex < corners; ++apex)
        for (std::uint32_t c = apex + 2; c < apex + corners; ++c)
          assembly.addTriangle(corner(apex), corner(c - 1), corner(c), 1.0 / corners);
    } else {
      for (std::uint32_t c = 2; c < corners; ++c) assembly.addTriangle(corner(0), corner(c - 1), corner(c), 1.0);
    }
  }
  for (std::uint32_t v = 0; v < vertices; ++v) {
    const double length = skin.normals.row(v).norm();
    if (length > 0) skin.normals.row(v) /= length;
  }

  skin.component.assign(vertices, 0);
  std::vector<bool> seen(vertices, false);
  std::vector<std::uint32_t> stack;
  std::uint32_t next = 0;
  for (std::uint32_t v = 0; v < vertices; ++v) {
    if (!skin.stands(v)) {
      skin.component[v] = skin.component[skin.same_as[v]];
      continue;
    }
    if (seen[v]) continue;
    stack.assign(1, v);
    seen[v] = true;
    while (!stack.empty()) {
      const std::uint32_t u = stack.back();
      stack.pop_back();
      skin.component[u] = next;
      for (std::uint32_t e = skin.graph.start[u]; e < skin.graph.start[u + 1]; ++e)
        if (!seen[skin.graph.neighbour[e]]) {
          seen[skin.graph.neighbour[e]] = true;
          stack.push_back(skin.graph.neighbour[e]);
        }
    }
    ++next;
  }
  for (auto t : triangulate(mesh)) {
    for (std::uint32_t& v : t) v = skin.same_as[v];
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) skin.triangles.push_back(t);
  }
  return skin;
}

}  // namespace volto::rig
