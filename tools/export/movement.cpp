#include "tools/export/movement.h"

#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "retarget/eyes.h"

namespace volto::exporter {
namespace {

Quaternion toArray(const Eigen::Quaterniond& q) {
  const Eigen::Quaterniond n = q.w() < 0 ? Eigen::Quaterniond(-q.w(), -q.x(), -q.y(), -q.z()) : q;
  return {static_cast<float>(n.x()), static_cast<float>(n.y()), static_cast<float>(n.z()), static_cast<float>(n.w())};
}

// Interpolation between neighbours must go the short way.
void append(std::vector<Quaternion>& track, Quaternion q, bool& moves) {
  if (!track.empty()) {
    const Quaternion& before = track.back();
    float dot = 0;
    for (std::size_t i = 0; i < 4; ++i) dot += before[i] * q[i];
    if (dot < 0)
      for (float& x : q) x = -x;
  }
  moves = moves || std::abs(q[3]) < 1.0F - 1e-7F;
  track.push_back(q);
}

}  // namespace

void MovementRecorder::add(const AvatarFrame& avatar, std::int64_t t_ns) {
  Movement& m = movement_;
  if (!m.time_s.empty() && t_ns <= last_ns_) return;
  if (m.time_s.empty()) first_ns_ = t_ns;
  last_ns_ = t_ns;
  m.time_s.push_back(static_cast<double>(t_ns - first_ns_) * 1e-9);
  for (std::size_t k = 0; k < rig_.blendshapes.size(); ++k)
    m.weights.push_back(k < avatar.weights.size() ? avatar.weights[k] : 0.0F);

  Quaternion head = m.head.empty() ? Quaternion{0, 0, 0, 1} : m.head.back();  // a head that is not seen stays
  if (avatar.head.observed) {
    const auto& r = avatar.head.rotation;  // head frame; its axis is turned into the mesh's
    const Eigen::Vector3d axis = rig_.mesh_from_head * Eigen::Vector3d(r[0], r[1], r[2]);
    head = toArray(Eigen::Quaterniond(static_cast<double>(r[3]), axis.x(), axis.y(), axis.z()).normalized());
  }
  append(m.head, head, m.head_moves);
  append(m.left_eye, eyeRotation(true, avatar), m.left_eye_moves);
  append(m.right_eye, eyeRotation(false, avatar), m.right_eye_moves);
}

Quaternion MovementRecorder::eyeRotation(bool left, const AvatarFrame& avatar) const {
  const auto wanted = left ? rig::RigidPart::Follows::left_eye : rig::RigidPart::Follows::right_eye;
  // W. Kabsch, A solution for the best rotation to relate two sets of vectors, 1976, about the part's own centre.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double size = 0;
  if (avatar.vertices.size() == rig_.neutral.vertexCount()) {
    for (const rig::RigidPart& part : rig_.rigid_parts) {
      if (part.follows != wanted) continue;
      const Eigen::Vector3d centre(part.centre[0], part.centre[1], part.centre[2]);
      for (const std::uint32_t v : part.vertices) {
        const auto& p = avatar.vertices[v];
        const Eigen::Vector3d from = rig_.neutral.positions.row(v).transpose() - centre;
        const Eigen::Vector3d to = Eigen::Vector3d(p[0], p[1], p[2]) - centre;
        covariance += to * from.transpose();
        size += from.squaredNorm();
      }
    }
  }
  if (size > 0) {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d fix = Eigen::Matrix3d::Identity();
    fix(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1.0 : 1.0;
    return toArray(Eigen::Quaterniond(svd.matrixU() * fix * svd.matrixV().transpose()));
  }
  if (!(avatar.gaze.confidence > 0.0F)) return {0, 0, 0, 1};
  const auto r = retarget::headFromEye(left ? avatar.gaze.left : avatar.gaze.right);
  Eigen::Matrix3d rotation;
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j) rotation(i, j) = r[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
  return toArray(Eigen::Quaterniond(rig_.mesh_from_head * rotation * rig_.mesh_from_head.transpose()));
}

}  // namespace volto::exporter
