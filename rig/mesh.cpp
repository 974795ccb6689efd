#include "rig/mesh.h"

#include <algorithm>
#include <numeric>

#include "rig/errors.h"

namespace volto::rig {

std::vector<std::array<std::uint32_t, 3>> triangulate(const Mesh& mesh) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  const std::size_t polygons = mesh.polygonCount();
  if (mesh.corner_vertices.size() > 2 * polygons) triangles.reserve(mesh.corner_vertices.size() - 2 * polygons);
  for (std::size_t p = 0; p < polygons; ++p) {
    const std::uint32_t first = mesh.polygon_start[p];
    for (std::uint32_t c = first + 2; c < mesh.polygon_start[p + 1]; ++c)
      triangles.push_back({mesh.corner_vertices[first], mesh.corner_vertices[c - 1], mesh.corner_vertices[c]});
  }
  return triangles;
}

std::vector<std::uint32_t> connectedComponents(const Mesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.vertexCount());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto find = [&parent](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p)
    for (std::uint32_t c = mesh.polygon_start[p] + 1; c < mesh.polygon_start[p + 1]; ++c) {
      const std::uint32_t a = find(mesh.corner_vertices[c - 1]);
      const std::uint32_t b = find(mesh.corner_vertices[c]);
      // The smaller index stays the root, so that numbers come out in the order of first vertices.
      if (a < b) parent[b] = a;
      if (b < a) parent[a] = b;
    }
  std::vector<std::uint32_t> component(mesh.vertexCount());
  std::uint32_t next = 0;
  for (std::uint32_t v = 0; v < component.size(); ++v) {
    const std::uint32_t root = find(v);
    component[v] = root == v ? next++ : component[root];
  }
  return component;
}

MeshHealth inspectMesh(const Mesh& mesh) {
  MeshHealth health;
  std::vector<bool> used(mesh.vertexCount(), false);
  std::vector<std::vector<std::uint32_t>> polygons(mesh.polygonCount());
  for (std::size_t p = 0; p < polygons.size(); ++p) {
    polygons[p].assign(mesh.corner_vertices.begin() + mesh.polygon_start[p],
                       mesh.corner_vertices.begin() + mesh.polygon_start[p + 1]);
    std::sort(polygons[p].begin(), polygons[p].end());
    for (const std::uint32_t v : polygons[p]) used[v] = true;
    if (std::adjacent_find(polygons[p].begin(), polygons[p].end()) != polygons[p].end()) ++health.degenerate_polygons;
  }
  std::sort(polygons.begin(), polygons.end());
  for (std::size_t p = 1; p < polygons.size(); ++p) health.duplicate_polygons += polygons[p] == polygons[p - 1] ? 1 : 0;
  health.unused_vertices = static_cast<std::size_t>(std::count(used.begin(), used.end(), false));
  return health;
}

bool sameTopology(const Mesh& a, const Mesh& b) {
  return a.vertexCount() == b.vertexCount() && a.polygon_start == b.polygon_start &&
         a.corner_vertices == b.corner_vertices;
}

void requireSameTopology(const Mesh& neutral, const Mesh& other, const std::string& name_for_errors) {
  if (sameTopology(neutral, other)) return;
  if (other.vertexCount() != neutral.vertexCount() || other.polygonCount() != neutral.polygonCount())
    throw InputError(name_for_errors + ": " + std::to_string(other.vertexCount()) + " vertices and " +
                     std::to_string(other.polygonCount()) + " polygons, the neutral mesh has " +
                     std::to_string(neutral.vertexCount()) + " and " + std::to_string(neutral.polygonCount()) +
                     "; an expression must be the same mesh, moved");
  throw InputError(name_for_errors + ": as many vertices and polygons as the neutral mesh, but joined in another way");
}

}  // namespace volto::rig
