#include "transfer/self_intersections.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <stdexcept>

#include <Eigen/Geometry>

namespace volto::transfer {
namespace {

constexpr std::uint32_t kLeaf = 8;

// Whether the open segment a-b passes through the triangle p, q, r.
bool passesThrough(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& p,
                   const Eigen::Vector3d& q, const Eigen::Vector3d& r, double touching) {
  const Eigen::Vector3d normal = (q - p).cross(r - p);
  const double size = normal.norm();
  if (!(size > 0)) return false;
  const Eigen::Vector3d n = normal / size;
  const double from = n.dot(a - p), to = n.dot(b - p);
  if (!((from > touching && to < -touching) || (from < -touching && to > touching))) return false;
  const Eigen::Vector3d hit = a + (from / (from - to)) * (b - a);
  return n.dot((q - p).cross(hit - p)) >= 0 && n.dot((r - q).cross(hit - q)) >= 0 && n.dot((p - r).cross(hit - r)) >= 0;
}

}  // namespace

SelfIntersections::SelfIntersections(const rig::VertexPositions& neutral, std::vector<Triangle> triangles,
                                     std::vector<bool> looked_at, double touching)
    : triangles_(std::move(triangles)), looked_at_(std::move(looked_at)), touching_(touching) {
  if (looked_at_.size() != triangles_.size())
    throw std::invalid_argument("SelfIntersections: sizes do not fit together");
  std::map<std::array<double, 3>, std::uint32_t> first_at;
  std::vector<std::uint32_t> same_as(static_cast<std::size_t>(neutral.rows()));
  for (std::uint32_t v = 0; v < same_as.size(); ++v)
    same_as[v] = first_at.try_emplace({neutral(v, 0), neutral(v, 1), neutral(v, 2)}, v).first->second;
  std::vector<Eigen::Vector3d> centres;
  for (const Triangle& t : triangles_) {
    joined_.push_back({same_as[t[0]], same_as[t[1]], same_as[t[2]]});
    centres.emplace_back((neutral.row(t[0]) + neutral.row(t[1]) + neutral.row(t[2])).transpose() / 3);
    order_.push_back(static_cast<std::uint32_t>(order_.size()));
  }
  if (triangles_.empty()) return;
  build(0, static_cast<std::uint32_t>(triangles_.size()), centres);
  at_rest_ = all(neutral, 0);
}

std::uint32_t SelfIntersections::build(std::uint32_t first, std::uint32_t count,
                                       const std::vector<Eigen::Vector3d>& centres) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  nodes_.push_back({first, count, 0});
  if (count <= kLeaf) return index;
  Eigen::AlignedBox3d box;
  for (std::uint32_t i = first; i < first + count; ++i) box.extend(centres[order_[i]]);
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  const auto middle = order_.begin() + first + count / 2;
  std::nth_element(order_.begin() + first, middle, order_.begin() + first + count,
                   [&](std::uint32_t a, std::uint32_t b) {
                     return centres[a][axis] != centres[b][axis] ? centres[a][axis] < centres[b][axis] : a < b;
                   });
  build(first, count / 2, centres);
  const std::uint32_t right = build(first + count / 2, count - count / 2, centres);
  nodes_[index].right = right;
  nodes_[index].count = 0;
  return index;
}

bool SelfIntersections::cross(const rig::VertexPositions& positions, double touching, std::uint32_t a,
                              std::uint32_t b) const {
  const Triangle &ta = joined_[a], &tb = joined_[b];
  const auto has = [](const Triangle& t, std::uint32_t v) { return t[0] == v || t[1] == v || t[2] == v; };
  const auto shared = static_cast<int>(has(tb, ta[0])) + static_cast<int>(has(tb, ta[1])) +
                      static_cast<int>(has(tb, ta[2]));
  if (shared > 1) return false;
  const auto edgesCross = [&](std::uint32_t of, std::uint32_t through) {
    for (std::size_t k = 0; k < 3; ++k) {
      // An edge that starts in a shared vertex meets the other triangle there; where the two go through each other, an
      // edge opposite to it does so too.
      if (has(joined_[through], joined_[of][k]) || has(joined_[through], joined_[of][(k + 1) % 3])) continue;
      const Triangle &t = triangles_[of], &u = triangles_[through];
      if (passesThrough(positions.row(t[k]), positions.row(t[(k + 1) % 3]), positions.row(u[0]), positions.row(u[1]),
                        positions.row(u[2]), touching))
        return true;
    }
    return false;
  };
  return edgesCross(a, b) || edgesCross(b, a);
}

std::vector<SelfIntersections::Pair> SelfIntersections::all(const rig::VertexPositions& positions, double touching) const {
  std::vector<Box> of_triangle(triangles_.size()), of_node(nodes_.size());
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const Eigen::Vector3d p = positions.row(triangles_[t][0]), q = positions.row(triangles_[t][1]),
                          r = positions.row(triangles_[t][2]);
    of_triangle[t] = {p.cwiseMin(q).cwiseMin(r), p.cwiseMax(q).cwiseMax(r)};
  }
  // Children come after their parent.
  for (std::size_t n = nodes_.size(); n-- > 0;) {
    const Node& node = nodes_[n];
    if (node.count == 0) {
      const Box &a = of_node[n + 1], &b = of_node[node.right];
      of_node[n] = {a.low.cwiseMin(b.low), a.high.cwiseMax(b.high)};
      continue;
    }
    Box box = of_triangle[order_[node.first]];
    for (std::uint32_t i = node.first + 1; i < node.first + node.count; ++i) {
      box.low = box.low.cwiseMin(of_triangle[order_[i]].low);
      box.high = box.high.cwiseMax(of_triangle[order_[i]].high);
    }
    of_node[n] = box;
  }
  const auto meet = [](const Box& a, const Box& b) {
    return (a.low.array() <= b.high.array()).all() && (b.low.array() <= a.high.array()).all();
  };
  std::vector<Pair> found;
  std::vector<std::uint32_t> open;
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    if (!looked_at_[t]) continue;
    open.assign(1, 0);
    while (!open.empty()) {
      const std::uint32_t n = open.back();
      open.pop_back();
      if (!meet(of_triangle[t], of_node[n])) continue;
      const Node& node = nodes_[n];
      if (node.count == 0) {
        open.push_back(n + 1);
        open.push_back(node.right);
        continue;
      }
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const std::uint32_t u = order_[i];
        // Two that are both looked at are met twice.
        if (u == t || (looked_at_[u] && u < t) || !meet(of_triangle[t], of_triangle[u])) continue;
        if (cross(positions, touching, t, u)) found.emplace_back(std::min(t, u), std::max(t, u));
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<SelfIntersections::Pair> SelfIntersections::find(const rig::VertexPositions& positions) const {
  if (triangles_.empty()) return {};
  const std::vector<Pair> now = all(positions, touching_);
  std::vector<Pair> out;
  std::set_difference(now.begin(), now.end(), at_rest_.begin(), at_rest_.end(), std::back_inserter(out));
  return out;
}

}  // namespace volto::transfer
