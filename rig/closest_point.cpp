#include "rig/closest_point.h"

#include <algorithm>
#include <numeric>

namespace volto::rig {

Eigen::Index nearestVertex(const VertexPositions& positions, const Eigen::RowVector3d& p) {
  Eigen::Index nearest = 0;
  (positions.rowwise() - p).rowwise().squaredNorm().minCoeff(&nearest);
  return nearest;
}

namespace {

double boxDistance2(const Eigen::Vector3d& p, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  return (low - p).cwiseMax(p - high).cwiseMax(0.0).squaredNorm();
}

}  // namespace

double shareOnSegment(const Eigen::Vector3d& p, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const double length2 = (to - from).squaredNorm();
  return length2 > 0 ? std::clamp((p - from).dot(to - from) / length2, 0.0, 1.0) : 0.0;
}

SurfacePoint closestPointOnTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                    const Eigen::Vector3d& c) {
  SurfacePoint best;
  const auto consider = [&](double u, double v, double w) {
    const double distance = (u * a + v * b + w * c - p).norm();
    if (distance < best.distance) best = {0, {u, v, w}, distance};
  };
  const Eigen::Vector3d ab = b - a, ac = c - a, ap = p - a;
  const double d00 = ab.squaredNorm(), d01 = ab.dot(ac), d11 = ac.squaredNorm();
  const double d20 = ap.dot(ab), d21 = ap.dot(ac);
  const double area = d00 * d11 - d01 * d01;
  if (area > 1e-14 * d00 * d11) {
    const double v = (d11 * d20 - d01 * d21) / area, w = (d00 * d21 - d01 * d20) / area;
    if (v >= 0 && w >= 0 && v + w <= 1) {
      consider(1 - v - w, v, w);
      return best;
    }
  }
  const double s = shareOnSegment(p, a, b), t = shareOnSegment(p, b, c), r = shareOnSegment(p, c, a);
  consider(1 - s, s, 0);
  consider(0, 1 - t, t);
  consider(r, 0, 1 - r);
  return best;
}

ClosestPoint::ClosestPoint(const VertexPositions& positions, std::vector<std::array<std::uint32_t, 3>> triangles)
    : positions_(positions), triangles_(std::move(triangles)), order_(triangles_.size()) {
  std::iota(order_.begin(), order_.end(), 0U);
  std::vector<Eigen::Vector3d> centres(triangles_.size());
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    centres[t] =
        (positions_.row(triangles_[t][0]) + positions_.row(triangles_[t][1]) + positions_.row(triangles_[t][2])) / 3.0;
  nodes_.reserve(triangles_.size() / 2 + 1);
  if (!triangles_.empty()) build(0, static_cast<std::uint32_t>(triangles_.size()), centres);
}

std::uint32_t ClosestPoint::build(std::uint32_t first, std::uint32_t count,
                                  const std::vector<Eigen::Vector3d>& centres) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  Node node;
  node.low.setConstant(std::numeric_limits<double>::infinity());
  node.high = -node.low;
  for (std::uint32_t i = first; i < first + count; ++i)
    for (const std::uint32_t v : triangles_[order_[i]]) {
      node.low = node.low.cwiseMin(positions_.row(v).transpose());
      node.high = node.high.cwiseMax(positions_.row(v).transpose());
    }
  if (count <= 8) {
    node.first = first;
    node.count = count;
  } else {
    int axis = 0;
    (node.high - node.low).maxCoeff(&axis);
    const std::uint32_t half = count / 2;
    std::nth_element(order_.begin() + first, order_.begin() + first + half, order_.begin() + first + count,
                     [&](std::uint32_t a, std::uint32_t b) {
                       return centres[a][axis] != centres[b][axis] ? centres[a][axis] < centres[b][axis] : a < b;
                     });
    build(first, half, centres);
    node.right = build(first + half, count - half, centres);
  }
  nodes_[index] = node;
  return index;
}

SurfacePoint ClosestPoint::find(const Eigen::Vector3d& p, double limit) const {
  SurfacePoint best;
  best.distance = limit;
  if (nodes_.empty()) return best;
  std::array<std::uint32_t, 64> stack{};
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const std::uint32_t index = stack[--depth];
    const Node& node = nodes_[index];
    if (boxDistance2(p, node.low, node.high) > best.distance * best.distance) continue;
    if (node.count > 0) {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const auto& t = triangles_[order_[i]];
        const SurfacePoint here =
            closestPointOnTriangle(p, positions_.row(t[0]), positions_.row(t[1]), positions_.row(t[2]));
        const bool tie = here.distance == best.distance && best.triangle >= 0 && order_[i] < best.triangle;
        if (here.distance < best.distance || tie) {
          best = here;
          best.triangle = order_[i];
        }
      }
      continue;
    }
    const std::uint32_t left = index + 1, right = node.right;
    const bool left_first =
        boxDistance2(p, nodes_[left].low, nodes_[left].high) < boxDistance2(p, nodes_[right].low, nodes_[right].high);
    stack[depth++] = left_first ? right : left;
    stack[depth++] = left_first ? left : right;
  }
  return best;
}

}  // namespace volto::rig
