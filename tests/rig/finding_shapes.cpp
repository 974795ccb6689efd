#include "tests/rig/finding_shapes.h"

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include <Eigen/Geometry>

namespace volto::rig::test {
namespace {

Mesh meshOf(const std::vector<Eigen::Vector3d>& points, const std::vector<std::vector<std::uint32_t>>& polygons) {
  Mesh mesh;
  mesh.positions.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) mesh.positions.row(static_cast<Eigen::Index>(i)) = points[i];
  mesh.polygon_start.push_back(0);
  for (const auto& polygon : polygons) {
    mesh.corner_vertices.insert(mesh.corner_vertices.end(), polygon.begin(), polygon.end());
    mesh.polygon_start.push_back(static_cast<std::uint32_t>(mesh.corner_vertices.size()));
  }
  return mesh;
}

// A round bar from a to b.
Mesh capsule(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius) {
  const Eigen::Vector3d axis = (b - a).normalized();
  const double half = (b - a).norm() / 2;
  const Eigen::Matrix3d turn = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), axis).toRotationMatrix();
  return shapedSphere(10, [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    Eigen::Vector3d q = radius * p;
    q.z() += p.z() > 0 ? half : -half;
    return (a + b) / 2 + turn * q;
  });
}

}  // namespace

Mesh shapedSphere(int n, const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& shape) {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::vector<std::uint32_t>> polygons;
  std::map<std::array<int, 3>, std::uint32_t> index;
  auto vertex = [&](const std::array<int, 3>& at) {
    const auto [it, is_new] = index.emplace(at, static_cast<std::uint32_t>(points.size()));
    if (is_new) points.push_back(shape(Eigen::Vector3d(2 * at[0] - n, 2 * at[1] - n, 2 * at[2] - n).normalized()));
    return it->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const int side : {0, n})
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          std::vector<std::uint32_t> quad;
          constexpr int kAround[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
          for (int c = 0; c < 4; ++c) {
            const auto& step = kAround[side == 0 ? 3 - c : c];
            std::array<int, 3> at{};
            at[axis] = side;
            at[(axis + 1) % 3] = i + step[0];
            at[(axis + 2) % 3] = j + step[1];
            quad.push_back(vertex(at));
          }
          polygons.push_back(quad);
        }
  return meshOf(points, polygons);
}

Mesh sphere() {
  return shapedSphere(24, [](const Eigen::Vector3d& p) { return p; });
}

Mesh cube() {
  return shapedSphere(16, [](const Eigen::Vector3d& p) -> Eigen::Vector3d { return p / p.cwiseAbs().maxCoeff(); });
}

Mesh cylinder() {
  return shapedSphere(24, [](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    const double r = std::hypot(p.x(), p.y());
    const double m = std::max(r, std::abs(p.z()));
    return {p.x() / m, p.y() / m, 2 * p.z() / m};
  });
}

Mesh flatPlane() {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::vector<std::uint32_t>> polygons;
  constexpr std::uint32_t kSide = 30;
  for (std::uint32_t j = 0; j <= kSide; ++j)
    for (std::uint32_t i = 0; i <= kSide; ++i) {
      points.emplace_back(i, j, 0);
      const std::uint32_t v = j * (kSide + 1) + i;
      if (i < kSide && j < kSide) polygons.push_back({v, v + 1, v + kSide + 2, v + kSide + 1});
    }
  return meshOf(points, polygons);
}

Mesh torus() {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::vector<std::uint32_t>> polygons;
  constexpr std::uint32_t kAround = 48;
  constexpr std::uint32_t kTube = 24;
  for (std::uint32_t i = 0; i < kAround; ++i)
    for (std::uint32_t j = 0; j < kTube; ++j) {
      const double u = 2 * std::numbers::pi * i / kAround;
      const double v = 2 * std::numbers::pi * j / kTube;
      points.emplace_back((2 + std::cos(v)) * std::cos(u), (2 + std::cos(v)) * std::sin(u), std::sin(v));
      const std::uint32_t i1 = (i + 1) % kAround;
      const std::uint32_t j1 = (j + 1) % kTube;
      polygons.push_back({i * kTube + j, i1 * kTube + j, i1 * kTube + j1, i * kTube + j1});
    }
  return meshOf(points, polygons);
}

Mesh symmetricBumps(std::uint32_t seed) {
  std::mt19937 random(seed);
  auto uniform = [&](double low, double high) { return low + (high - low) * (static_cast<double>(random()) / 4294967296.0); };
  struct Bump {
    Eigen::Vector3d at;
    double height, width;
  };
  std::vector<Bump> bumps;
  for (int i = 0; i < 14; ++i) {
    const Eigen::Vector3d at = Eigen::Vector3d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)).normalized();
    bumps.push_back({at, uniform(-0.25, 0.35), uniform(0.15, 0.5)});
    bumps.push_back({{-at.x(), at.y(), at.z()}, bumps.back().height, bumps.back().width});
  }
  return shapedSphere(40, [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    double r = 1;
    for (const Bump& b : bumps) r += b.height * std::exp(-(p - b.at).squaredNorm() / (b.width * b.width));
    return {r * p.x(), 1.3 * r * p.y(), r * p.z()};
  });
}

Mesh headlessBody() {
  std::vector<Mesh> parts;
  parts.push_back(shapedSphere(24, [](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    return {3 * p.x(), -4.5 + 4.5 * p.y(), 1.8 * p.z() + (p.z() > 0 ? 0.3 * p.y() : 0)};
  }));
  for (const double side : {-1.0, 1.0}) {
    parts.push_back(capsule({side * 2.6, -1, 0}, {side * 5, -6, 0}, 0.8));
    parts.push_back(capsule({side * 5, -6, 0}, {side * 6, -11, 1}, 0.6));
    parts.push_back(capsule({side * 1.5, -8.5, 0}, {side * 1.6, -16, 0.2}, 1.2));
    parts.push_back(capsule({side * 1.6, -16, 0.2}, {side * 1.6, -23, 0}, 0.8));
    parts.push_back(capsule({side * 1.6, -23.6, 0}, {side * 1.9, -23.8, 2.6}, 0.6));
  }
  parts.push_back(capsule({0, -0.5, 0}, {0, 1.2, 0.2}, 0.9));
  return together(std::move(parts));
}

Mesh hand() {
  std::vector<Mesh> parts;
  parts.push_back(shapedSphere(16, [](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    const Eigen::Vector3d q = p / std::pow(p.cwiseAbs().maxCoeff(), 0.6);
    return {2 * q.x(), 2.2 * q.y(), 0.7 * q.z()};
  }));
  const double tips[4] = {5.2, 6.0, 5.7, 4.6};
  for (int i = 0; i < 4; ++i) parts.push_back(capsule({-1.5 + i, 1.8, 0}, {-1.8 + 1.2 * i, tips[i], 0.3}, 0.45));
  parts.push_back(capsule({-1.8, -0.8, 0}, {-3.6, 1.4, 0.8}, 0.55));
  parts.push_back(capsule({0, -2, 0}, {0, -5, 0}, 1.1));
  return together(std::move(parts));
}

Mesh together(std::vector<Mesh> meshes) {
  Mesh all;
  all.polygon_start.push_back(0);
  for (const Mesh& mesh : meshes) {
    const std::uint32_t first = static_cast<std::uint32_t>(all.vertexCount());
    const std::uint32_t corner = static_cast<std::uint32_t>(all.corner_vertices.size());
    all.positions.conservativeResize(all.positions.rows() + mesh.positions.rows(), 3);
    all.positions.bottomRows(mesh.positions.rows()) = mesh.positions;
    for (const std::uint32_t v : mesh.corner_vertices) all.corner_vertices.push_back(first + v);
    for (std::size_t p = 1; p < mesh.polygon_start.size(); ++p)
      all.polygon_start.push_back(corner + mesh.polygon_start[p]);
  }
  return all;
}

Mesh moved(Mesh mesh, const Eigen::Matrix3d& rotation, double scale, const Eigen::Vector3d& shift) {
  const VertexPositions positions = scale * mesh.positions * rotation.transpose();
  mesh.positions = positions.rowwise() + shift.transpose();
  return mesh;
}

Mesh noisy(Mesh mesh, double amount, std::uint32_t seed) {
  std::mt19937 random(seed);
  for (Eigen::Index v = 0; v < mesh.positions.rows(); ++v)
    for (int axis = 0; axis < 3; ++axis) mesh.positions(v, axis) += amount * (2 * (static_cast<double>(random()) / 4294967296.0) - 1);
  return mesh;
}

Mesh clustered(const Mesh& mesh, double cell) {
  std::map<std::array<long, 3>, std::uint32_t> index;
  std::vector<Eigen::Vector3d> sums;
  std::vector<double> counts;
  std::vector<std::uint32_t> to(mesh.vertexCount());
  for (std::uint32_t v = 0; v < to.size(); ++v) {
    const Eigen::Vector3d p = mesh.positions.row(v);
    std::array<long, 3> key{};
    for (int axis = 0; axis < 3; ++axis) key[axis] = std::lround(p[axis] / cell);
    const auto [it, is_new] = index.emplace(key, static_cast<std::uint32_t>(sums.size()));
    if (is_new) sums.push_back(Eigen::Vector3d::Zero()), counts.push_back(0);
    to[v] = it->second;
    sums[it->second] += p;
    counts[it->second] += 1;
  }
  for (std::size_t i = 0; i < sums.size(); ++i) sums[i] /= counts[i];
  std::vector<std::vector<std::uint32_t>> polygons;
  for (const auto& t : triangulate(mesh))
    if (to[t[0]] != to[t[1]] && to[t[1]] != to[t[2]] && to[t[2]] != to[t[0]])
      polygons.push_back({to[t[0]], to[t[1]], to[t[2]]});
  return meshOf(sums, polygons);
}

Mesh cropped(const Mesh& mesh, const std::function<bool(std::uint32_t vertex)>& keep) {
  Mesh result;
  result.positions = mesh.positions;
  result.polygon_start.push_back(0);
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    bool all = true;
    for (std::uint32_t c = mesh.polygon_start[p]; c < mesh.polygon_start[p + 1]; ++c)
      all = all && keep(mesh.corner_vertices[c]);
    if (!all) continue;
    for (std::uint32_t c = mesh.polygon_start[p]; c < mesh.polygon_start[p + 1]; ++c)
      result.corner_vertices.push_back(mesh.corner_vertices[c]);
    result.polygon_start.push_back(static_cast<std::uint32_t>(result.corner_vertices.size()));
  }
  return result;
}

}  // namespace volto::rig::test
