// Where skin goes through itself: lips through each other, a lid's fold through the lid. Triangle by triangle, so that
// it is counted wherever it happens, also where no contact was foreseen (rig/contacts.h measures depth at the margins).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "rig/mesh.h"

namespace volto::transfer {

// Const calls from several threads are fine. Borrows nothing.
class SelfIntersections {
 public:
  using Triangle = std::array<std::uint32_t, 3>;
  using Pair = std::pair<std::uint32_t, std::uint32_t>;  // indices into the triangles, first < second

  // `looked_at`: one per triangle; pairs with none of those are not looked for. Vertices at the very same place at rest
  // (seams of texture coordinates) count as one, so that neighbours across a seam do not cross. `touching`: length below
  // which two triangles only touch.
  SelfIntersections(const rig::VertexPositions& neutral, std::vector<Triangle> triangles, std::vector<bool> looked_at,
                    double touching);

  // Pairs of triangles that go through each other at `positions` (#V by 3) and at rest neither do nor touch; ascending. Two triangles
  // cross when an edge of one passes through the other, off the vertices that they share, with both ends farther than
  // `touching` from its plane; triangles with a common edge do not.
  std::vector<Pair> find(const rig::VertexPositions& positions) const;

  const std::vector<Pair>& atRest() const { return at_rest_; }
  const Triangle& triangle(std::uint32_t t) const { return triangles_[t]; }

 private:
  struct Node {
    std::uint32_t first = 0, count = 0;  // of order_; count 0: two children, the first follows directly
    std::uint32_t right = 0;
  };
  struct Box {
    Eigen::Vector3d low, high;
  };
  std::uint32_t build(std::uint32_t first, std::uint32_t count, const std::vector<Eigen::Vector3d>& centres);
  std::vector<Pair> all(const rig::VertexPositions& positions, double touching) const;
  bool cross(const rig::VertexPositions& positions, double touching, std::uint32_t a, std::uint32_t b) const;

  std::vector<Triangle> triangles_;
  std::vector<Triangle> joined_;  // the same with one vertex for all at its place
  std::vector<bool> looked_at_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;  // a tree of boxes by where triangles are at rest; its boxes are made anew for each pose
  double touching_;
  std::vector<Pair> at_rest_;
};

}  // namespace volto::transfer
