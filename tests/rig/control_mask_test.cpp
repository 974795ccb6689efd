#include "rig/control_mask.h"

#include <algorithm>
#include <array>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace volto::rig {
namespace {

using Edge = std::pair<int, int>;

std::vector<std::string> ids(std::initializer_list<const char*> list) { return {list.begin(), list.end()}; }

template <std::size_t N>
std::set<std::string> idSet(const std::array<std::uint8_t, N>& loop) {
  std::set<std::string> result;
  for (const std::uint8_t point : loop) result.insert(std::string(featurePoints()[point].id));
  return result;
}

std::map<Edge, int> directedEdges() {
  std::map<Edge, int> edges;
  for (const MaskTriangle& t : maskTriangles())
    for (int i = 0; i < 3; ++i) ++edges[{t[static_cast<std::size_t>(i)], t[static_cast<std::size_t>((i + 1) % 3)]}];
  return edges;
}

// The boundary as next-point map: the edges that only one triangle has.
std::map<int, int> boundary() {
  const auto edges = directedEdges();
  std::map<int, int> next;
  for (const auto& [edge, count] : edges)
    if (!edges.contains({edge.second, edge.first})) next[edge.first] = edge.second;
  return next;
}

template <std::size_t N>
bool isBoundaryLoop(const std::array<std::uint8_t, N>& loop) {
  const auto next = boundary();
  const auto follows = [&](bool forward) {
    for (std::size_t i = 0; i < N; ++i) {
      const int a = loop[i], b = loop[(i + 1) % N];
      const auto found = next.find(forward ? a : b);
      if (found == next.end() || found->second != (forward ? b : a)) return false;
    }
    return true;
  };
  return follows(true) || follows(false);
}

double smallestAngle_deg(const FeaturePointPositions& positions, const MaskTriangle& t) {
  double smallest = 180;
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::RowVector3d a = positions.row(t[i]), b = positions.row(t[(i + 1) % 3]),
                             c = positions.row(t[(i + 2) % 3]);
    smallest = std::min(smallest, std::acos((b - a).normalized().dot((c - a).normalized())) * 180 / std::numbers::pi);
  }
  return smallest;
}

}  // namespace

TEST(ControlMask, IsADiskWithThreeHolesOverAllPoints) {
  std::set<int> used;
  for (const MaskTriangle& t : maskTriangles()) used.insert(t.begin(), t.end());
  EXPECT_EQ(used.size(), kFeaturePointCount);
  std::set<Edge> undirected;
  for (const auto& [edge, count] : directedEdges()) undirected.insert(std::minmax(edge.first, edge.second));
  const int euler =
      static_cast<int>(kFeaturePointCount) - static_cast<int>(undirected.size()) + static_cast<int>(kMaskTriangleCount);
  EXPECT_EQ(euler, 1 - 3);
  EXPECT_EQ(boundary().size(), 36U);
}

TEST(ControlMask, NoEdgeIsUsedTwiceInOneDirection) {
  for (const auto& [edge, count] : directedEdges())
    EXPECT_EQ(count, 1) << featurePoints()[static_cast<std::size_t>(edge.first)].id << " - "
                        << featurePoints()[static_cast<std::size_t>(edge.second)].id;
}

TEST(ControlMask, LoopsAreEyesMouthAndOutlineOfTheDesign) {
  const MaskLoops& loops = maskLoops();
  EXPECT_TRUE(isBoundaryLoop(loops.outline));
  EXPECT_TRUE(isBoundaryLoop(loops.left_eye));
  EXPECT_TRUE(isBoundaryLoop(loops.right_eye));
  EXPECT_TRUE(isBoundaryLoop(loops.mouth));
  std::vector<std::string> outline;
  for (const std::uint8_t point : loops.outline) outline.emplace_back(featurePoints()[point].id);
  EXPECT_EQ(outline,
            ids({"11.1", "11.3", "10.9", "10.7", "2.13", "12.17", "2.1", "12.18", "2.14", "10.8", "10.10", "11.2"}));
  EXPECT_EQ(idSet(loops.left_eye),
            (std::set<std::string>{"3.7", "3.11", "3.1", "3.3", "12.5", "12.6", "12.7", "12.8"}));
  EXPECT_EQ(idSet(loops.right_eye),
            (std::set<std::string>{"3.8", "3.12", "3.2", "3.4", "12.9", "12.10", "12.11", "12.12"}));
  EXPECT_EQ(idSet(loops.mouth), (std::set<std::string>{"2.2", "2.3", "2.4", "2.5", "2.6", "2.7", "2.8", "2.9"}));
}

TEST(ControlMask, SwappingLeftAndRightMapsTheMaskOntoItself) {
  const auto canonical = [](MaskTriangle t) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
  };
  std::map<MaskTriangle, FaceRegion> triangles;
  for (std::size_t i = 0; i < kMaskTriangleCount; ++i) triangles[canonical(maskTriangles()[i])] = maskTriangleRegion(i);
  ASSERT_EQ(triangles.size(), kMaskTriangleCount);
  for (const MaskTriangle& t : maskTriangles()) {
    const auto m = [](std::uint8_t p) { return featurePoints()[p].mirror; };
    EXPECT_TRUE(triangles.contains(canonical({m(t[0]), m(t[2]), m(t[1])}))) << featurePoints()[t[0]].id;
  }
}

TEST(ControlMask, UpperAndLowerLipOrLidNeverShareALabel) {
  const auto lies = [](const MaskTriangle& t, std::initializer_list<const char*> points) {
    return std::ranges::any_of(t, [&](std::uint8_t p) {
      return std::ranges::any_of(points, [&](const char* id) { return featurePoints()[p].id == id; });
    });
  };
  for (std::size_t i = 0; i < kMaskTriangleCount; ++i) {
    const MaskTriangle& t = maskTriangles()[i];
    const FaceRegion region = maskTriangleRegion(i);
    if (region == FaceRegion::upper_lip) {
      EXPECT_FALSE(lies(t, {"2.3", "2.8", "2.9", "8.2", "8.7", "8.8", "12.15", "12.16"})) << i;
    }
    if (region == FaceRegion::lower_lip) {
      EXPECT_FALSE(lies(t, {"2.2", "2.6", "2.7", "8.1", "8.5", "8.6", "8.9", "8.10"})) << i;
    }
    if (region == FaceRegion::left_upper_lid) {
      EXPECT_FALSE(lies(t, {"3.3", "3.9", "12.7", "12.8"})) << i;
    }
    if (region == FaceRegion::left_lower_lid) {
      EXPECT_FALSE(lies(t, {"3.1", "3.13", "12.5", "12.6"})) << i;
    }
  }
}

TEST(ReferenceMask, IsMirrorSymmetricToTheBit) {
  for (std::size_t i = 0; i < kFeaturePointCount; ++i) {
    const auto here = referenceMask().row(static_cast<Eigen::Index>(i));
    const auto there = referenceMask().row(featurePoints()[i].mirror);
    EXPECT_EQ(here.x(), -there.x() + 0.0) << featurePoints()[i].id;
    EXPECT_EQ(here.y(), there.y()) << featurePoints()[i].id;
    EXPECT_EQ(here.z(), there.z()) << featurePoints()[i].id;
  }
}

TEST(ReferenceMask, TrianglesFaceOutOfTheFaceAndNoneIsASliver) {
  const FeaturePointPositions& mask = referenceMask();
  const Eigen::RowVector3d inside(0, -30, -60);  // a point in the middle of the head
  for (const MaskTriangle& t : maskTriangles()) {
    const Eigen::RowVector3d a = mask.row(t[0]), b = mask.row(t[1]), c = mask.row(t[2]);
    const Eigen::RowVector3d normal = (b - a).cross(c - a);
    EXPECT_GT(normal.dot((a + b + c) / 3 - inside), 0) << featurePoints()[t[0]].id << " " << featurePoints()[t[1]].id;
    EXPECT_GT(smallestAngle_deg(mask, t), 7)
        << featurePoints()[t[0]].id << " " << featurePoints()[t[1]].id << " " << featurePoints()[t[2]].id;
  }
}

}  // namespace volto::rig
