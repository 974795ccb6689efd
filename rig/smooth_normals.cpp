#include <algorithm>
#include <numeric>
#include <span>
#include <stdexcept>
#include <tuple>

#include <Eigen/Geometry>

#include "rig/mesh.h"

namespace volto::rig {
namespace {

using Row = Eigen::RowVector3d;

// Vertices by place; those at the same place stand together.
std::vector<std::uint32_t> sortedByPlace(const VertexPositions& p) {
  std::vector<std::uint32_t> order(static_cast<std::size_t>(p.rows()));
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::tuple(p(a, 0), p(a, 1), p(a, 2), a) < std::tuple(p(b, 0), p(b, 1), p(b, 2), b);
  });
  return order;
}

}  // namespace

VertexPositions smoothNormals(const Mesh& mesh, const VertexPositions& positions) {
  if (positions.rows() != mesh.positions.rows())
    throw std::invalid_argument("smoothNormals: positions of another mesh");
  VertexPositions sums = VertexPositions::Zero(positions.rows(), 3);
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    const std::uint32_t first = mesh.polygon_start[p], end = mesh.polygon_start[p + 1];
    const Row origin = positions.row(mesh.corner_vertices[first]);
    Row normal = Row::Zero();  // Newell: twice the area, for any polygon
    for (std::uint32_t c = first + 2; c < end; ++c)
      normal +=
          (positions.row(mesh.corner_vertices[c - 1]) - origin).cross(positions.row(mesh.corner_vertices[c]) - origin);
    for (std::uint32_t c = first; c < end; ++c) sums.row(mesh.corner_vertices[c]) += normal;
  }
  VertexPositions normals(positions.rows(), 3);
  const std::vector<std::uint32_t> order = sortedByPlace(mesh.positions);
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    while (end < order.size() && mesh.positions.row(order[end]) == mesh.positions.row(order[begin])) ++end;
    constexpr std::size_t kMostSharers = 64;  // so that a heap of equal points cannot take for ever
    const std::span<const std::uint32_t> here(order.data() + begin, std::min(end - begin, kMostSharers));
    for (std::size_t i = begin; i < end; ++i) {
      const Row own = sums.row(order[i]);
      Row sum = own;
      for (const std::uint32_t other : here)
        if (other != order[i] && own.dot(sums.row(other)) > 0) sum += sums.row(other);
      const double length = sum.norm();
      normals.row(order[i]) = length > 0 ? Row(sum / length) : Row(0, 0, 1);
    }
  }
  return normals;
}

}  // namespace volto::rig
