#include "transfer/lining.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "rig/closest_point.h"
#include "transfer/surface.h"

namespace volto::transfer {
namespace {

constexpr double kDeepestEs = 0.2;
constexpr double kLeastForward = 0.2;  // cosine between the skin's normal and the face's direction
constexpr double kLeastReachEs = 0.02;
constexpr double kNearest = 0.5;  // of the depth at rest

}  // namespace

Lining::Lining(const rig::Rig& rig, const std::vector<bool>& inside, std::vector<std::array<std::uint32_t, 3>> skin) {
  const rig::VertexPositions& neutral = rig.neutral.positions;
  const rig::ClosestPoint nearest(neutral, std::move(skin));
  if (nearest.empty()) return;
  const Eigen::Vector3d forward = rig.mesh_from_head.col(2);
  const double limit = kDeepestEs * rig.fapu.fapu.eye_separation;
  for (std::uint32_t v = 0; v < inside.size(); ++v) {
    if (!inside[v]) continue;
    const Eigen::Vector3d here = neutral.row(v);
    const rig::SurfacePoint on = nearest.find(here, limit);
    if (on.triangle < 0) continue;
    Vertex lining{v, nearest.triangle(on.triangle), on.barycentric};
    const Eigen::Vector3d normal = normalOf(neutral, lining.skin);
    const double facing = normal.dot(forward);
    if (std::abs(facing) < kLeastForward) continue;
    lining.side = facing > 0 ? 1 : -1;
    lining.depth = -lining.side * normal.dot(here - at(neutral, {lining.skin, lining.weight}));
    lining.reach = std::max(lining.depth, kLeastReachEs * rig.fapu.fapu.eye_separation);
    if (lining.depth > 0.5 * on.distance && lining.depth > 0) vertices_.push_back(lining);
  }
}

void Lining::keepBehind(rig::VertexPositions& positions) const {
  for (const Vertex& l : vertices_) {
    const Eigen::Vector3d outwards = l.side * normalOf(positions, l.skin);
    const Eigen::Vector3d off = positions.row(l.vertex).transpose() - at(positions, {l.skin, l.weight});
    const double depth = -outwards.dot(off);
    if (depth >= kNearest * l.depth) continue;
    // Only what is still behind it: the inside of an upper lip lies behind the lower one until the jaw opens.
    const double aside = (off + depth * outwards).norm();
    const double share = std::clamp(2 - aside / l.reach, 0.0, 1.0);
    positions.row(l.vertex) -= (share * (kNearest * l.depth - depth) * outwards).transpose();
  }
}

}  // namespace volto::transfer
