// The nearest point of a triangle surface, by a tree of boxes.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "rig/mesh.h"

namespace volto::rig {

struct SurfacePoint {
  std::int64_t triangle = -1;                  // index into the triangles given; -1: none within the limit
  std::array<double, 3> barycentric{0, 0, 0};  // >= 0, sum 1
  double distance = std::numeric_limits<double>::infinity();
};

// The row of `positions` (not empty) that is nearest to `p`.
Eigen::Index nearestVertex(const VertexPositions& positions, const Eigen::RowVector3d& p);

// How far along the segment its nearest point to p lies: 0 at `from`, 1 at `to`; 0 for one without length.
double shareOnSegment(const Eigen::Vector3d& p, const Eigen::Vector3d& from, const Eigen::Vector3d& to);

// The nearest point of one triangle; a degenerate one counts as its longest edge.
SurfacePoint closestPointOnTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                    const Eigen::Vector3d& c);

// Reentrant once built. Borrows `positions`, which must outlive it.
class ClosestPoint {
 public:
  ClosestPoint(const VertexPositions& positions, std::vector<std::array<std::uint32_t, 3>> triangles);

  SurfacePoint find(const Eigen::Vector3d& p, double limit = std::numeric_limits<double>::infinity()) const;
  const std::array<std::uint32_t, 3>& triangle(std::int64_t t) const { return triangles_[static_cast<std::size_t>(t)]; }
  bool empty() const { return triangles_.empty(); }

 private:
  struct Node {
    Eigen::Vector3d low, high;
    std::uint32_t first = 0, count = 0;  // triangles of a leaf
    std::uint32_t right = 0;             // second child; the first follows directly
  };
  std::uint32_t build(std::uint32_t first, std::uint32_t count, const std::vector<Eigen::Vector3d>& centres);

  const VertexPositions& positions_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

// Those of `triangles` that reach into the box and that `wanted` takes, in their order.
template <class Wanted>
std::vector<std::array<std::uint32_t, 3>> trianglesNear(const VertexPositions& positions,
                                                        const std::vector<std::array<std::uint32_t, 3>>& triangles,
                                                        const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                                                        const Wanted& wanted) {
  std::vector<std::array<std::uint32_t, 3>> out;
  for (const auto& t : triangles) {
    bool apart = false;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double a = positions(t[0], axis), b = positions(t[1], axis), c = positions(t[2], axis);
      apart = apart || (a < low[axis] && b < low[axis] && c < low[axis]) ||
              (a > high[axis] && b > high[axis] && c > high[axis]);
    }
    if (!apart && wanted(t)) out.push_back(t);
  }
  return out;
}

}  // namespace volto::rig
