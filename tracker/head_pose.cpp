#include "tracker/head_pose.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace volto::tracker {

Eigen::Matrix3d headRotation(const HeadAngles& angles) {
  return (Eigen::AngleAxisd(angles.yaw_rad, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(angles.pitch_rad, Eigen::Vector3d::UnitX()) *
          Eigen::AngleAxisd(angles.roll_rad, Eigen::Vector3d::UnitZ()))
      .toRotationMatrix();
}

HeadAngles headAngles(const Eigen::Matrix3d& r) {
  // Third column of Ry Rx Rz: (sin yaw cos pitch, -sin pitch, cos yaw cos pitch); second row: (cos p sin r, cos p cos
  // r, -sin p).
  HeadAngles angles;
  angles.pitch_rad = -std::asin(std::clamp(r(1, 2), -1.0, 1.0));
  if (std::abs(r(1, 2)) > 1.0 - 1e-9) {
    angles.yaw_rad = std::atan2(-r(2, 0), r(0, 0));
    return angles;
  }
  angles.yaw_rad = std::atan2(r(0, 2), r(2, 2));
  angles.roll_rad = std::atan2(r(1, 0), r(1, 1));
  return angles;
}

void setHeadPose(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation_camera_mm, HeadPose& out) {
  Eigen::Quaterniond q(rotation);
  q.normalize();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  out.rotation = {static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z()),
                  static_cast<float>(q.w())};
  const HeadAngles angles = headAngles(rotation);
  out.yaw_rad = static_cast<float>(angles.yaw_rad);
  out.pitch_rad = static_cast<float>(angles.pitch_rad);
  out.roll_rad = static_cast<float>(angles.roll_rad);
  for (int c = 0; c < 3; ++c)
    out.translation_mm[static_cast<std::size_t>(c)] = static_cast<float>(translation_camera_mm[c]);
  out.observed = true;
}

void mixHeadPose(const HeadPose& from, const HeadPose& to, float share, HeadPose& out) {
  const auto turn = [](const HeadPose& pose) {
    return Eigen::Quaterniond(pose.rotation[3], pose.rotation[0], pose.rotation[1], pose.rotation[2]);
  };
  Eigen::Vector3d translation;
  for (Eigen::Index c = 0; c < 3; ++c) {
    const auto i = static_cast<std::size_t>(c);
    translation[c] = from.translation_mm[i] + share * (to.translation_mm[i] - from.translation_mm[i]);
  }
  const bool observed = out.observed;
  setHeadPose(turn(from).slerp(share, turn(to)).normalized().toRotationMatrix(), translation, out);
  out.observed = observed;
}

}  // namespace volto::tracker
