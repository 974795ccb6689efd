#include "transfer/self_intersections.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "tests/transfer/sheet.h"

namespace volto::transfer {
namespace {

using Pair = SelfIntersections::Pair;

constexpr double kTouching = 1e-6;

// Two triangles, the second one `x` aside of the first and standing in its plane's way.
rig::VertexPositions twoTriangles(double x) {
  rig::VertexPositions p(6, 3);
  p << 0, 0, 0, 1, 0, 0, 0, 1, 0, x + 0.2, 0.2, -1, x + 0.2, 0.2, 1, x + 0.3, 0.3, 1;
  return p;
}
const std::vector<SelfIntersections::Triangle> kTwo = {{0, 1, 2}, {3, 4, 5}};

TEST(SelfIntersections, TrianglesThatGoThroughEachOtherAreFoundOnce) {
  const SelfIntersections crossing(twoTriangles(5), kTwo, {true, true}, kTouching);
  EXPECT_EQ(crossing.find(twoTriangles(0)), (std::vector<Pair>{{0, 1}}));
  EXPECT_TRUE(crossing.find(twoTriangles(2)).empty());
}

TEST(SelfIntersections, OneOfThemMustBeLookedAt) {
  EXPECT_EQ(SelfIntersections(twoTriangles(5), kTwo, {false, true}, kTouching).find(twoTriangles(0)).size(), 1U);
  EXPECT_TRUE(SelfIntersections(twoTriangles(5), kTwo, {false, false}, kTouching).find(twoTriangles(0)).empty());
}

TEST(SelfIntersections, WhatCrossesAtRestIsNotCounted) {
  const SelfIntersections crossing(twoTriangles(0), kTwo, {true, true}, kTouching);
  EXPECT_EQ(crossing.atRest().size(), 1U);
  EXPECT_TRUE(crossing.find(twoTriangles(0.01)).empty());
}

TEST(SelfIntersections, WhatIsLessDeepThanATouchIsNotCounted) {
  rig::VertexPositions now = twoTriangles(0);
  now.bottomRows(3).col(2).array() += 0.9;  // 0.1 of it below the other triangle
  EXPECT_EQ(SelfIntersections(twoTriangles(5), kTwo, {true, true}, 0.09).find(now).size(), 1U);
  EXPECT_TRUE(SelfIntersections(twoTriangles(5), kTwo, {true, true}, 0.11).find(now).empty());
}

TEST(SelfIntersections, SheetThatOnlyBendsDoesNotCrossItself) {
  const Sheet sheet = makeSheet(24, 8, 0.2);
  const auto triangles = rig::triangulate(sheet.mesh);
  const SelfIntersections crossing(sheet.mesh.positions, triangles, std::vector<bool>(triangles.size(), true),
                                   kTouching);
  EXPECT_TRUE(crossing.atRest().empty());
  EXPECT_TRUE(crossing.find(curled(sheet, 3)).empty());
}

// Truth: every pair tried, by points on its edges: a triangle crosses the other when one of its edges changes sides
// inside of it.
TEST(SelfIntersections, RolledSheetHasThePairsThatTryingAllOfThemFinds) {
  const Sheet sheet = makeSheet(24, 8, 0.2);
  const auto triangles = rig::triangulate(sheet.mesh);
  rig::VertexPositions rolled = curled(sheet, 8);  // more than once around
  // Uneven, so that nothing merely touches.
  for (Eigen::Index v = 0; v < rolled.rows(); ++v)
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      rolled(v, axis) += 0.05 * std::sin(1 + 7.7 * static_cast<double>(v) + 2.3 * static_cast<double>(axis));
  const auto all = std::vector<bool>(triangles.size(), true);
  const std::vector<Pair> found = SelfIntersections(sheet.mesh.positions, triangles, all, 0).find(rolled);
  std::vector<Pair> truth;
  const auto point = [&](std::uint32_t v) { return Eigen::Vector3d(rolled.row(v)); };
  const auto pierces = [&](const SelfIntersections::Triangle& of, const SelfIntersections::Triangle& through) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d a = point(of[k]), b = point(of[(k + 1) % 3]), p = point(through[0]),
                            q = point(through[1]), r = point(through[2]);
      const auto volume = [](const Eigen::Vector3d& s, const Eigen::Vector3d& t, const Eigen::Vector3d& u,
                             const Eigen::Vector3d& w) { return (t - s).dot((u - s).cross(w - s)); };
      const double side_a = volume(p, q, r, a), side_b = volume(p, q, r, b);
      if (!(side_a * side_b < 0)) continue;
      const double x = volume(a, b, p, q), y = volume(a, b, q, r), z = volume(a, b, r, p);
      if ((x > 0 && y > 0 && z > 0) || (x < 0 && y < 0 && z < 0)) return true;
    }
    return false;
  };
  for (std::uint32_t i = 0; i < triangles.size(); ++i)
    for (std::uint32_t j = i + 1; j < triangles.size(); ++j) {
      int shared = 0;
      for (const std::uint32_t v : triangles[i])
        shared += static_cast<int>(std::count(triangles[j].begin(), triangles[j].end(), v));
      if (shared == 0 && (pierces(triangles[i], triangles[j]) || pierces(triangles[j], triangles[i])))
        truth.emplace_back(i, j);
    }
  EXPECT_GT(truth.size(), 20U);
  EXPECT_EQ(found, truth);
}

TEST(SelfIntersections, NeighboursAcrossASeamDoNotCross) {
  // Two triangles of one fold whose common edge has two copies of each vertex.
  rig::VertexPositions rest(6, 3);
  rest << 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, -1, 0, 0;
  rig::VertexPositions now = rest;
  now.row(5) << 1, 0.2, 1e-3;  // folded over, and the seam a little askew
  now(3, 2) -= 1e-2;
  EXPECT_TRUE(SelfIntersections(rest, {{0, 1, 2}, {3, 4, 5}}, {true, true}, kTouching).find(now).empty());
}

TEST(SelfIntersections, NoTrianglesCrossNowhere) {
  EXPECT_TRUE(SelfIntersections(twoTriangles(0), {}, {}, kTouching).find(twoTriangles(0)).empty());
  EXPECT_THROW(SelfIntersections(twoTriangles(0), kTwo, {true}, kTouching), std::invalid_argument);
}

}  // namespace
}  // namespace volto::transfer
