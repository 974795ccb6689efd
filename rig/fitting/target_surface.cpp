#include "rig/fitting/target_surface.h"

#include <algorithm>
#include <numeric>

#include <Eigen/Geometry>

#include "rig/closest_point.h"

namespace volto::rig {
namespace {

double boxDistance2(const Eigen::Vector3d& p, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  return (low - p).cwiseMax(p - high).cwiseMax(0.0).squaredNorm();
}

std::vector<std::uint8_t> boundaryEdges(const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  std::vector<std::pair<std::uint64_t, std::uint64_t>> uses;  // edge, triangle * 3 + opposite corner
  uses.reserve(3 * triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint64_t a = triangles[t][(i + 1) % 3], b = triangles[t][(i + 2) % 3];
      uses.emplace_back(std::min(a, b) << 32 | std::max(a, b), 3 * t + i);
    }
  std::sort(uses.begin(), uses.end());
  std::vector<std::uint8_t> out(triangles.size(), 0);
  for (std::size_t i = 0; i < uses.size();) {
    std::size_t j = i + 1;
    while (j < uses.size() && uses[j].first == uses[i].first) ++j;
    if (j == i + 1)
      out[uses[i].second / 3] = static_cast<std::uint8_t>(out[uses[i].second / 3] | 1U << (uses[i].second % 3));
    i = j;
  }
  return out;
}

}  // namespace

TargetSurface::TargetSurface(VertexPositions positions, std::vector<std::array<std::uint32_t, 3>> triangles)
    : positions_(std::move(positions)), triangles_(std::move(triangles)), order_(triangles_.size()) {
  std::iota(order_.begin(), order_.end(), 0U);
  std::vector<Eigen::Vector3d> centres(triangles_.size());
  normals_.resize(triangles_.size());
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const Eigen::Vector3d a = positions_.row(triangles_[t][0]), b = positions_.row(triangles_[t][1]),
                          c = positions_.row(triangles_[t][2]);
    centres[t] = (a + b + c) / 3.0;
    const Eigen::Vector3d cross = (b - a).cross(c - a);
    const double length = cross.norm();
    normals_[t] = length > 0 ? Eigen::Vector3d(cross / length) : Eigen::Vector3d::Zero();
  }
  boundary_ = boundaryEdges(triangles_);
  nodes_.reserve(triangles_.size() / 2 + 1);
  if (!triangles_.empty()) build(0, static_cast<std::uint32_t>(triangles_.size()), centres);
}

std::uint32_t TargetSurface::build(std::uint32_t first, std::uint32_t count,
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
  if (count <= 6) {
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

SurfaceHit TargetSurface::find(const Eigen::Vector3d& p, const Eigen::Vector3d& normal, double min_cosine,
                               double limit) const {
  SurfaceHit best;
  if (nodes_.empty()) return best;
  best.distance = limit;
  std::array<std::uint32_t, 64> stack{};
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const std::uint32_t index = stack[--depth];
    const Node& node = nodes_[index];
    if (boxDistance2(p, node.low, node.high) > best.distance * best.distance) continue;
    if (node.count > 0) {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        if (normals_[order_[i]].dot(normal) < min_cosine) continue;
        const auto& t = triangles_[order_[i]];
        const SurfacePoint here =
            closestPointOnTriangle(p, positions_.row(t[0]), positions_.row(t[1]), positions_.row(t[2]));
        const bool tie = here.distance == best.distance && best.triangle >= 0 && order_[i] < best.triangle;
        if (here.distance < best.distance || tie) {
          best.triangle = order_[i];
          best.barycentric = here.barycentric;
          best.distance = here.distance;
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
  if (best.triangle >= 0) {
    const auto& t = triangle(best.triangle);
    for (std::size_t i = 0; i < 3; ++i) best.position += best.barycentric[i] * positions_.row(t[i]).transpose();
  } else {
    best.distance = std::numeric_limits<double>::infinity();
  }
  return best;
}

bool TargetSurface::onBoundary(const SurfaceHit& hit) const {
  if (hit.triangle < 0) return false;
  for (std::size_t i = 0; i < 3; ++i)
    if (hit.barycentric[i] < 1e-9 && (boundary_[static_cast<std::size_t>(hit.triangle)] >> i & 1U) != 0) return true;
  return false;
}

}  // namespace volto::rig
