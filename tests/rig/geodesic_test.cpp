#include "rig/geodesic.h"

#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

namespace volto::rig {
namespace {

// A flat sheet of quads `width` long and `height` high each, cut in two.
Mesh sheet(std::uint32_t columns, std::uint32_t rows, double width, double height) {
  Mesh mesh;
  mesh.positions.resize(static_cast<Eigen::Index>((columns + 1) * (rows + 1)), 3);
  mesh.polygon_start.push_back(0);
  const auto at = [&](std::uint32_t x, std::uint32_t y) { return y * (columns + 1) + x; };
  for (std::uint32_t y = 0; y <= rows; ++y)
    for (std::uint32_t x = 0; x <= columns; ++x) mesh.positions.row(at(x, y)) << x * width, y * height, 0;
  for (std::uint32_t y = 0; y < rows; ++y)
    for (std::uint32_t x = 0; x < columns; ++x)
      for (const auto& t : {std::array{at(x, y), at(x + 1, y), at(x + 1, y + 1)},
                            std::array{at(x, y), at(x + 1, y + 1), at(x, y + 1)}}) {
        mesh.corner_vertices.insert(mesh.corner_vertices.end(), t.begin(), t.end());
        mesh.polygon_start.push_back(static_cast<std::uint32_t>(mesh.corner_vertices.size()));
      }
  return mesh;
}

EdgeGraph graphOf(const Mesh& mesh) {
  std::vector<std::uint32_t> same(mesh.vertexCount());
  std::iota(same.begin(), same.end(), 0U);
  return buildEdgeGraph(mesh, mesh, same);
}

TEST(SurfaceDistances, FromARowOfVerticesAreTheHeightsAboveItHoweverLongTheTrianglesAre) {
  for (const double width : {0.2, 1.0, 5.0, 20.0}) {
    const Mesh mesh = sheet(12, 9, width, 1.0);
    std::vector<GeodesicSource> row;
    for (std::uint32_t x = 0; x <= 12; ++x) row.push_back({x, 0.0F});
    const GeodesicDistances d = surfaceDistances(graphOf(mesh), row);
    for (std::uint32_t v = 0; v < mesh.vertexCount(); ++v)
      EXPECT_NEAR(d.distance[v], mesh.positions(v, 1), 1e-4) << width;
  }
}

TEST(SurfaceDistances, HardlyDependOnTheTriangles) {
  // From one side of a square to the points of the other half, over diagonals of either way and over long triangles.
  for (const auto& [columns, rows] : {std::pair{20U, 20U}, {40U, 10U}, {10U, 40U}}) {
    const Mesh mesh = sheet(columns, rows, 10.0 / columns, 10.0 / rows);
    std::vector<GeodesicSource> some;
    for (std::uint32_t v = 0; v < mesh.vertexCount(); ++v)
      if (mesh.positions(v, 0) + mesh.positions(v, 1) < 5 + 1e-9) some.push_back({v, 0.0F});
    const GeodesicDistances d = surfaceDistances(graphOf(mesh), some);
    for (std::uint32_t v = 0; v < mesh.vertexCount(); ++v) {
      const double x = mesh.positions(v, 0), y = mesh.positions(v, 1);
      const double expected = std::max(0.0, (x + y - 5) / std::sqrt(2.0));
      if (std::abs(x - y) < 4) {
        EXPECT_NEAR(d.distance[v], expected, 0.35) << columns << " x " << rows;
      }
    }
  }
}

TEST(EdgeGraph, KnowsEachNeighbourOnceInOrder) {
  const EdgeGraph graph = graphOf(sheet(3, 3, 1, 1));
  ASSERT_EQ(graph.vertexCount(), 16U);
  for (std::uint32_t v = 0; v < 16; ++v)
    for (std::uint32_t e = graph.start[v]; e < graph.start[v + 1]; ++e) {
      if (e > graph.start[v]) {
        EXPECT_LT(graph.neighbour[e - 1], graph.neighbour[e]);
      }
      const bool along = std::abs(static_cast<int>(graph.neighbour[e]) - static_cast<int>(v)) != 5;
      EXPECT_FLOAT_EQ(graph.length[e], along ? 1.0F : std::sqrt(2.0F));
    }
  EXPECT_EQ(graph.start[6] - graph.start[5], 6U);  // inside: four sides and two diagonals
}

}  // namespace
}  // namespace volto::rig
