#include "transfer/surface.h"

#include <Eigen/Geometry>

namespace volto::transfer {

bool isNone(const SurfacePoint& p) { return p.weight[0] == 0 && p.weight[1] == 0 && p.weight[2] == 0; }

Eigen::Vector3d at(const rig::VertexPositions& positions, const SurfacePoint& p) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < 3; ++i) sum += p.weight[i] * positions.row(p.vertex[i]).transpose();
  return sum;
}

Eigen::Vector3d at(const rig::VertexPositions& positions, const rig::SlitContact::Sample& s) {
  const auto share = static_cast<double>(s.share_of_second);
  return (1 - share) * positions.row(s.first) + share * positions.row(s.second);
}

Eigen::Vector3d normalOf(const rig::VertexPositions& positions, const std::array<std::uint32_t, 3>& triangle) {
  const Eigen::Vector3d a = positions.row(triangle[0]), b = positions.row(triangle[1]), c = positions.row(triangle[2]);
  const Eigen::Vector3d n = (b - a).cross(c - a);
  const double length = n.norm();
  return length > 0 ? Eigen::Vector3d(n / length) : Eigen::Vector3d::Zero();
}

SkinTriangles skinTriangles(const rig::Rig& rig) {
  std::vector<bool> part(rig.neutral.vertexCount(), false);
  for (const rig::RigidPart& p : rig.rigid_parts)
    for (const std::uint32_t v : p.vertices) part[v] = true;
  SkinTriangles out;
  const auto all = rig::triangulate(rig.neutral);
  for (std::size_t t = 0; t < all.size(); ++t) {
    if (part[all[t][0]]) continue;
    out.triangles.push_back(all[t]);
    out.index.push_back(static_cast<std::int32_t>(t));
  }
  return out;
}

}  // namespace volto::transfer
