#include "tests/rig/remesh.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <stdexcept>
#include <tuple>

#include <Eigen/Geometry>

namespace volto::test {
namespace {

using rig::Mesh;
using Triangle = std::array<std::uint32_t, 3>;

Mesh meshOf(const rig::VertexPositions& positions, const std::vector<Triangle>& triangles) {
  Mesh mesh;
  mesh.positions = positions;
  mesh.polygon_start.push_back(0);
  for (const Triangle& t : triangles) {
    mesh.corner_vertices.insert(mesh.corner_vertices.end(), t.begin(), t.end());
    mesh.polygon_start.push_back(static_cast<std::uint32_t>(mesh.corner_vertices.size()));
  }
  return mesh;
}

}  // namespace

Remeshed subdivided(const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  std::vector<Eigen::RowVector3d> added;
  const auto first = static_cast<std::uint32_t>(mesh.vertexCount());
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [at, is_new] = middles.try_emplace(std::minmax(a, b), first + static_cast<std::uint32_t>(added.size()));
    if (is_new) added.emplace_back((mesh.positions.row(a) + mesh.positions.row(b)) / 2);
    return at->second;
  };
  std::vector<Triangle> triangles;
  for (const auto& [a, b, c] : rig::triangulate(mesh)) {
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    triangles.insert(triangles.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  rig::VertexPositions positions(mesh.positions.rows() + static_cast<Eigen::Index>(added.size()), 3);
  positions.topRows(mesh.positions.rows()) = mesh.positions;
  for (std::size_t i = 0; i < added.size(); ++i) positions.row(first + static_cast<Eigen::Index>(i)) = added[i];
  Remeshed out{meshOf(positions, triangles), {}};
  out.original.assign(out.mesh.vertexCount(), -1);
  std::iota(out.original.begin(), out.original.begin() + first, 0);
  return out;
}

Remeshed decimated(const Mesh& mesh, double share, const std::vector<std::uint32_t>& keep) {
  std::vector<Triangle> triangles = rig::triangulate(mesh);
  const std::size_t vertices = mesh.vertexCount();
  std::vector<std::set<std::uint32_t>> around(vertices);  // triangles
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (const std::uint32_t v : triangles[t]) around[v].insert(t);
  std::vector<bool> fixed(vertices, false);
  for (const std::uint32_t v : keep) fixed[v] = true;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  for (const Triangle& t : triangles)
    for (std::size_t i = 0; i < 3; ++i) ++uses[std::minmax(t[i], t[(i + 1) % 3])];
  // Garland and Heckbert: the squared distance to the planes of all triangles that have gone into a vertex, by area; and
  // a trace of length, so that on a flat place the short edges go first.
  std::vector<Eigen::Matrix4d> quadric(vertices, Eigen::Matrix4d::Zero());
  for (const Triangle& t : triangles) {
    const Eigen::Vector3d a = mesh.positions.row(t[0]), b = mesh.positions.row(t[1]), c = mesh.positions.row(t[2]);
    const Eigen::Vector3d cross = (b - a).cross(c - a);
    if (!(cross.norm() > 0)) continue;
    Eigen::Vector4d plane;
    plane << cross.normalized(), -cross.normalized().dot(a);
    for (const std::uint32_t v : t) quadric[v] += 0.5 * cross.norm() * plane * plane.transpose();
  }
  struct Collapse {
    double cost;
    std::uint32_t goes, stays, stamp;  // stamp: collapses into either when this was reckoned
    bool operator<(const Collapse& o) const {
      return std::tie(cost, goes, stays, stamp) < std::tie(o.cost, o.goes, o.stays, o.stamp);
    }
  };
  std::set<Collapse> queue;
  std::vector<std::uint32_t> stamp(vertices, 0);
  for (const auto& [edge, count] : uses)
    if (count != 2) fixed[edge.first] = fixed[edge.second] = true;
  const auto offer = [&](std::uint32_t goes, std::uint32_t stays) {
    if (fixed[goes]) return;
    const Eigen::Matrix4d q = quadric[goes] + quadric[stays];
    Eigen::Vector4d at;
    at << mesh.positions.row(stays).transpose(), 1;
    const double area = q.topLeftCorner<3, 3>().trace();
    const double length2 = (mesh.positions.row(goes) - mesh.positions.row(stays)).squaredNorm();
    queue.insert({at.dot(q * at) + 1e-4 * area * length2, goes, stays, stamp[goes] + stamp[stays]});
  };
  for (const auto& [edge, count] : uses) {
    offer(edge.first, edge.second);
    offer(edge.second, edge.first);
  }
  std::size_t left = vertices;
  const auto wanted = static_cast<std::size_t>(share * static_cast<double>(vertices));
  while (left > wanted && !queue.empty()) {
    const auto [cost, goes, stays, when] = *queue.begin();
    queue.erase(queue.begin());
    if (around[goes].empty() || around[stays].empty() || when != stamp[goes] + stamp[stays]) continue;
    std::set<std::uint32_t> of_goes, of_stays;
    std::vector<std::uint32_t> shared;
    for (const std::uint32_t t : around[goes]) {
      of_goes.insert(triangles[t].begin(), triangles[t].end());
      if (around[stays].contains(t)) shared.push_back(t);
    }
    for (const std::uint32_t t : around[stays]) of_stays.insert(triangles[t].begin(), triangles[t].end());
    std::vector<std::uint32_t> common;
    std::set_intersection(of_goes.begin(), of_goes.end(), of_stays.begin(), of_stays.end(), std::back_inserter(common));
    if (shared.size() != 2 || common.size() != 4) continue;  // both ends and the two corners opposite
    bool turns = false;
    for (const std::uint32_t t : around[goes]) {
      if (around[stays].contains(t)) continue;
      const auto normal = [&](bool after) -> Eigen::Vector3d {
        Eigen::Vector3d p[3];
        for (std::size_t i = 0; i < 3; ++i)
          p[i] = mesh.positions.row(after && triangles[t][i] == goes ? stays : triangles[t][i]);
        return (p[1] - p[0]).cross(p[2] - p[0]);
      };
      const Eigen::Vector3d before = normal(false), after = normal(true);
      turns |= before.dot(after) < 0.7 * before.norm() * after.norm() || after.norm() < 0.05 * before.norm();
    }
    if (turns) continue;
    for (const std::uint32_t t : shared)
      for (const std::uint32_t v : triangles[t])
        if (v != goes) around[v].erase(t);
    for (const std::uint32_t t : around[goes]) {
      if (std::find(shared.begin(), shared.end(), t) != shared.end()) continue;
      for (std::uint32_t& v : triangles[t])
        if (v == goes) v = stays;
      around[stays].insert(t);
    }
    around[goes].clear();
    quadric[stays] += quadric[goes];
    ++stamp[stays];
    --left;
    for (const std::uint32_t t : around[stays])
      for (const std::uint32_t v : triangles[t])
        if (v != stays) {
          offer(v, stays);
          offer(stays, v);
        }
  }
  std::vector<std::int64_t> slot(vertices, -1);
  Remeshed out;
  std::vector<Triangle> kept;
  for (std::uint32_t v = 0; v < vertices; ++v)
    if (!around[v].empty()) {
      slot[v] = static_cast<std::int64_t>(out.original.size());
      out.original.push_back(v);
    }
  rig::VertexPositions positions(static_cast<Eigen::Index>(out.original.size()), 3);
  for (std::size_t i = 0; i < out.original.size(); ++i)
    positions.row(static_cast<Eigen::Index>(i)) = mesh.positions.row(out.original[i]);
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    if (around[triangles[t][0]].contains(t))
      kept.push_back({static_cast<std::uint32_t>(slot[triangles[t][0]]),
                      static_cast<std::uint32_t>(slot[triangles[t][1]]),
                      static_cast<std::uint32_t>(slot[triangles[t][2]])});
  out.mesh = meshOf(positions, kept);
  return out;
}

Remeshed shuffled(const Mesh& mesh, std::uint32_t seed) {
  std::mt19937 random(seed);
  Remeshed out;
  out.original.resize(mesh.vertexCount());
  std::iota(out.original.begin(), out.original.end(), 0);
  for (std::size_t i = out.original.size(); i > 1; --i) std::swap(out.original[i - 1], out.original[random() % i]);
  std::vector<std::uint32_t> slot(mesh.vertexCount());
  out.mesh.positions.resize(mesh.positions.rows(), 3);
  for (std::size_t i = 0; i < slot.size(); ++i) {
    slot[static_cast<std::size_t>(out.original[i])] = static_cast<std::uint32_t>(i);
    out.mesh.positions.row(static_cast<Eigen::Index>(i)) = mesh.positions.row(out.original[i]);
  }
  std::vector<std::size_t> order(mesh.polygonCount());
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random() % i]);
  out.mesh.polygon_start.push_back(0);
  for (const std::size_t p : order) {
    for (std::uint32_t c = mesh.polygon_start[p]; c < mesh.polygon_start[p + 1]; ++c)
      out.mesh.corner_vertices.push_back(slot[mesh.corner_vertices[c]]);
    out.mesh.polygon_start.push_back(static_cast<std::uint32_t>(out.mesh.corner_vertices.size()));
  }
  return out;
}

rig::FeaturePointChoices pointsOn(const Remeshed& remeshed, const rig::FeaturePointChoices& points) {
  rig::FeaturePointChoices out;
  for (const auto& [p, choice] : points) {
    const auto at = std::find(remeshed.original.begin(), remeshed.original.end(), std::get<std::uint32_t>(choice));
    if (at == remeshed.original.end()) throw std::runtime_error("a feature point is on the first mesh alone");
    out[p] = static_cast<std::uint32_t>(at - remeshed.original.begin());
  }
  return out;
}

}  // namespace volto::test
