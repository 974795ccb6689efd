// The head as a surface: closed where it should be, oriented, symmetric, without degenerate faces.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "rig/assets/head/head_mesh.h"
#include "tests/rig/head_intersections.h"

namespace volto::head {
namespace {

class HeadTopology : public ::testing::TestWithParam<bool> {
 protected:
  static const Head& head() {
    static const Head made[] = {makeHead(adult()), makeHead(creature())};
    return made[GetParam() ? 1 : 0];
  }
  static const Vec3& at(int v) { return head().vertices[static_cast<std::size_t>(v)]; }
  static std::map<std::pair<int, int>, int> directedEdges() {
    std::map<std::pair<int, int>, int> edges;
    for (const Polygon& polygon : head().polygons)
      for (std::size_t i = 0; i < polygon.corners.size(); ++i)
        ++edges[{polygon.corners[i], polygon.corners[(i + 1) % polygon.corners.size()]}];
    return edges;
  }
};

TEST_P(HeadTopology, IsAnOrientedManifold) {
  for (const auto& [edge, count] : directedEdges()) ASSERT_EQ(count, 1) << edge.first << " -> " << edge.second;
}

TEST_P(HeadTopology, IsOpenAtTheNeckAndBehindTheLidsOnly) {
  const auto edges = directedEdges();
  std::map<int, int> next;  // along the border
  for (const auto& [edge, count] : edges)
    if (!edges.contains({edge.second, edge.first})) {
      ASSERT_FALSE(next.contains(edge.first)) << "two borders meet at vertex " << edge.first;
      next[edge.first] = edge.second;
    }
  const Vec3 eye = eyeCentre(head().character.proportions);
  int neck = 0, left_lids = 0, right_lids = 0, other = 0;
  while (!next.empty()) {
    const int start = next.begin()->first;
    Vec3 sum;
    int length = 0;
    for (int v = start; next.contains(v); ++length) {
      sum = sum + at(v);
      const int following = next[v];
      next.erase(v);
      v = following;
    }
    const Vec3 middle = sum * (1.0 / length);
    if (middle.y < -15 && std::fabs(middle.x) < 1e-9)
      ++neck;
    else if (std::fabs(middle.y - eye.y) < 1 && std::fabs(middle.x - eye.x) < 1)
      ++left_lids;
    else if (std::fabs(middle.y - eye.y) < 1 && std::fabs(middle.x + eye.x) < 1)
      ++right_lids;
    else
      ++other;
  }
  EXPECT_EQ(neck, 1);
  EXPECT_EQ(left_lids, 1);
  EXPECT_EQ(right_lids, 1);
  EXPECT_EQ(other, 0);
}

TEST_P(HeadTopology, LeftAndRightMirrorExactly) {
  for (std::size_t v = 0; v < head().vertices.size(); ++v) {
    const int m = head().mirror[v];
    ASSERT_EQ(head().mirror[static_cast<std::size_t>(m)], static_cast<int>(v));
    const Vec3 &a = head().vertices[v], &b = at(m);
    ASSERT_EQ(a.x, -b.x);
    ASSERT_EQ(a.y, b.y);
    ASSERT_EQ(a.z, b.z);
  }
  std::set<std::vector<int>> polygons;
  const auto canonical = [](std::vector<int> corners) {
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    return corners;
  };
  for (const Polygon& polygon : head().polygons) polygons.insert(canonical(polygon.corners));
  ASSERT_EQ(polygons.size(), head().polygons.size());
  for (const Polygon& polygon : head().polygons) {
    std::vector<int> mirrored;
    for (auto c = polygon.corners.rbegin(); c != polygon.corners.rend(); ++c)
      mirrored.push_back(head().mirror[static_cast<std::size_t>(*c)]);
    ASSERT_TRUE(polygons.contains(canonical(mirrored)));
  }
}

TEST_P(HeadTopology, NoTriangleIsDegenerate) {
  double smallest = 1;
  for (const Polygon& polygon : head().polygons)
    for (std::size_t i = 1; i + 1 < polygon.corners.size(); ++i) {
      const Vec3 a = at(polygon.corners[0]), b = at(polygon.corners[i]), c = at(polygon.corners[i + 1]);
      smallest = std::min(smallest, 0.5 * length(cross(b - a, c - a)));
    }
  EXPECT_GT(smallest, 5e-6);  // square centimetres; five decimals are written
}

// The whole head at rest: skin, eyeballs, teeth, tongue, lashes and brows, each with itself and with the others.
TEST_P(HeadTopology, NoTriangleGoesThroughAnother) {
  std::vector<Triangle> triangles;
  std::vector<int> component;
  for (std::size_t p = 0; p < head().polygons.size(); ++p) {
    const auto& corners = head().polygons[p].corners;
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
      triangles.push_back({corners[0], corners[i], corners[i + 1]});
      component.push_back(head().polygon_component[p]);
    }
  }
  const auto crossing = crossingTriangles(head().vertices, triangles);
  for (std::size_t i = 0; i < crossing.size() && i < 5; ++i) {
    const auto& [a, b] = crossing[i];
    const Vec3& place = at(triangles[a][0]);
    ADD_FAILURE() << head().components[static_cast<std::size_t>(component[a])].name << " and "
                  << head().components[static_cast<std::size_t>(component[b])].name << " near " << place.x << ' '
                  << place.y << ' ' << place.z;
  }
  EXPECT_EQ(crossing.size(), 0U);
}

// One point of the texture belongs to one place of the head: what the triangles cover together is as large as the sum
// of their areas, counted on a raster; none is turned over.
TEST_P(HeadTopology, TextureCoordinatesDoNotOverlapAndFillMostOfTheAtlas) {
  constexpr int kSize = 1024;
  std::vector<unsigned char> hits(static_cast<std::size_t>(kSize) * kSize, 0);
  double area = 0;
  long overlapping = 0, covered = 0;
  for (const Polygon& polygon : head().polygons) {
    ASSERT_EQ(polygon.uv.size(), polygon.corners.size());
    for (std::size_t i = 1; i + 1 < polygon.uv.size(); ++i) {
      const std::array<double, 2>&a = polygon.uv[0], &b = polygon.uv[i], &c = polygon.uv[i + 1];
      for (const auto& uv : {a, b, c})
        for (const double x : uv) ASSERT_TRUE(x >= 0 && x <= 1) << x;
      const auto side = [](const std::array<double, 2>& p, const std::array<double, 2>& q, double x, double y) {
        return (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
      };
      const double twice = side(a, b, c[0], c[1]);
      ASSERT_GT(twice, 0) << "turned over or without an area";
      area += twice / 2;
      const auto pixel = [](double x) { return static_cast<int>(std::floor(x * kSize)); };
      for (int y = pixel(std::min({a[1], b[1], c[1]})); y <= pixel(std::max({a[1], b[1], c[1]})); ++y)
        for (int x = pixel(std::min({a[0], b[0], c[0]})); x <= pixel(std::max({a[0], b[0], c[0]})); ++x) {
          const double u = (x + 0.5) / kSize, v = (y + 0.5) / kSize;
          if (!(side(a, b, u, v) > 0 && side(b, c, u, v) > 0 && side(c, a, u, v) > 0)) continue;
          unsigned char& hit = hits[static_cast<std::size_t>(y) * kSize + static_cast<std::size_t>(x)];
          overlapping += hit;
          covered += 1 - hit;
          hit = 1;
        }
    }
  }
  EXPECT_EQ(overlapping, 0);
  EXPECT_GT(area, 0.65);
  EXPECT_NEAR(static_cast<double>(covered) / kSize / kSize, area, 0.002);
}

TEST_P(HeadTopology, TextureAndColoursMirrorToo) {
  std::map<std::vector<int>, std::size_t> by_corners;
  for (std::size_t p = 0; p < head().polygons.size(); ++p) by_corners[head().polygons[p].corners] = p;
  for (const Polygon& polygon : head().polygons) {
    std::vector<int> corners{head().mirror[static_cast<std::size_t>(polygon.corners[0])]};
    for (std::size_t i = polygon.corners.size(); i-- > 1;)
      corners.push_back(head().mirror[static_cast<std::size_t>(polygon.corners[i])]);
    ASSERT_TRUE(by_corners.contains(corners)) << "mirrored polygons begin with the same corner";
    const Polygon& other = head().polygons[by_corners[corners]];
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const auto& uv = polygon.uv[i == 0 ? 0 : corners.size() - i];
      ASSERT_NEAR(other.uv[i][0], 1 - uv[0], 1e-12);
      ASSERT_EQ(other.uv[i][1], uv[1]);
    }
  }
  for (std::size_t v = 0; v < head().vertices.size(); ++v) {
    const Vec3 &a = head().tints[v], &b = head().tints[static_cast<std::size_t>(head().mirror[v])];
    ASSERT_EQ(length(a - b), 0);
    for (const double x : {a.x, a.y, a.z}) ASSERT_TRUE(x > 0 && x <= 1) << x;
  }
}

TEST(CrossingTriangles, AreFoundWhereTheyAreAndNowhereElse) {
  const std::vector<Vec3> at{{0, 0, 0},     {1, 0, 0},   {0, 1, 0},   // flat
                             {.2, .2, -1},  {.2, .3, 1}, {2, 2, 1},   // through it
                             {0, 0, .1},    {1, 0, .1},  {0, 1, .1},  // above it, cut by the second too
                             {1, 1, 0},                               // neighbour in the same plane
                             {.3, .3, 1e-4}};                         // folded back onto the first
  const auto pairs = [&](std::vector<Triangle> triangles) { return crossingTriangles(at, triangles).size(); };
  EXPECT_EQ(pairs({{0, 1, 2}, {3, 4, 5}}), 1U);
  EXPECT_EQ(pairs({{0, 1, 2}, {3, 4, 5}, {6, 7, 8}}), 2U);
  EXPECT_EQ(pairs({{0, 1, 2}, {6, 7, 8}}), 0U);
  EXPECT_EQ(pairs({{0, 1, 2}, {2, 1, 9}}), 0U);
  EXPECT_EQ(pairs({{0, 1, 2}, {2, 1, 10}}), 1U) << "folded over the shared edge";
  EXPECT_EQ(pairs({{0, 1, 2}, {0, 3, 4}}), 1U) << "one shared vertex, and through the inside";
  EXPECT_EQ(pairs({{0, 1, 2}, {0, 6, 8}}), 0U) << "one shared vertex, and nothing else";
}

TEST_P(HeadTopology, FacesLookOutOfEveryComponent) {
  std::vector<double> volume(head().components.size(), 0);
  for (std::size_t p = 0; p < head().polygons.size(); ++p) {
    const auto& corners = head().polygons[p].corners;
    for (std::size_t i = 1; i + 1 < corners.size(); ++i)
      volume[static_cast<std::size_t>(head().polygon_component[p])] +=
          dot(at(corners[0]), cross(at(corners[i]), at(corners[i + 1]))) / 6;
  }
  for (std::size_t c = 0; c < volume.size(); ++c) EXPECT_GT(volume[c], 0) << head().components[c].name;
  // The skin: cubic centimetres of a head with its neck; the creature's skull is larger.
  EXPECT_NEAR(volume[0], GetParam() ? 4500 : 3500, 700);
}

TEST_P(HeadTopology, IsMadeOfQuadsAndOfAReasonableSize) {
  std::size_t quads = 0;
  for (const Polygon& polygon : head().polygons) quads += polygon.corners.size() == 4 ? 1 : 0;
  EXPECT_GT(static_cast<double>(quads), 0.98 * static_cast<double>(head().polygons.size()));
  EXPECT_GE(head().vertices.size(), 8000U);
  EXPECT_LE(head().vertices.size(), 20000U);
  std::set<int> used;
  for (const Polygon& polygon : head().polygons) used.insert(polygon.corners.begin(), polygon.corners.end());
  EXPECT_EQ(used.size(), head().vertices.size()) << "a vertex belongs to no polygon";
}

INSTANTIATE_TEST_SUITE_P(Of, HeadTopology, ::testing::Bool(),
                         [](const auto& which) { return which.param ? "Creature" : "Adult"; });

}  // namespace
}  // namespace volto::head
