// The head that is fitted to, in the generic head's frame and unit: closest points among those that may correspond.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "rig/mesh.h"

namespace volto::rig {

struct SurfaceHit {
  std::int64_t triangle = -1;  // -1: none within the limit
  std::array<double, 3> barycentric{0, 0, 0};
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double distance = std::numeric_limits<double>::infinity();
};

// A tree of boxes, as in rig/closest_point.h, whose leaves also look at normals. Reentrant once built.
class TargetSurface {
 public:
  // Triangles run counter-clockwise seen from outside.
  TargetSurface(VertexPositions positions, std::vector<std::array<std::uint32_t, 3>> triangles);

  // The nearest point among triangles whose normal n has n . normal >= min_cosine (-1: all).
  SurfaceHit find(const Eigen::Vector3d& p, const Eigen::Vector3d& normal, double min_cosine, double limit) const;

  std::size_t triangleCount() const { return triangles_.size(); }
  const VertexPositions& positions() const { return positions_; }
  const std::array<std::uint32_t, 3>& triangle(std::int64_t t) const { return triangles_[static_cast<std::size_t>(t)]; }
  const Eigen::Vector3d& normal(std::int64_t t) const { return normals_[static_cast<std::size_t>(t)]; }
  // Does the hit lie on an edge that only one triangle has?
  bool onBoundary(const SurfaceHit& hit) const;

 private:
  struct Node {
    Eigen::Vector3d low, high;
    std::uint32_t first = 0, count = 0, right = 0;
  };
  std::uint32_t build(std::uint32_t first, std::uint32_t count, const std::vector<Eigen::Vector3d>& centres);

  VertexPositions positions_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<Eigen::Vector3d> normals_;
  std::vector<std::uint8_t> boundary_;  // bit i: the edge opposite corner i
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace volto::rig
