// Which way a head turns: the signs and the order of the head angles in Volto.
//
// Head frame: +x to the subject's left, +y up, +z out of the face. A head that looks straight into an upright camera
// has rotation identity; its axes are then x to the right in the image, y up, z towards the camera. For a point p of
// the head frame
//   p_camera = diag(1, -1, -1) * R * p + translation,    R = Ry(yaw) * Rx(pitch) * Rz(roll),
// with the camera frame x right, y down, z away, and R turning right-handed about the axes of the upright,
// camera-facing head:
//   yaw   > 0: the face turns to the subject's left (to the right in an image that is not mirrored),
//   pitch > 0: the face turns down,
//   roll  > 0: the head leans to the subject's right (its left ear comes up).
// These are the signs of headYaw, headPitch and headRoll in the CSV files that Volto writes.
#pragma once

#include <Eigen/Core>

#include "frames/mask_frame.h"

namespace volto::tracker {

struct HeadAngles {
  double yaw_rad = 0;
  double pitch_rad = 0;  // -pi/2 .. pi/2
  double roll_rad = 0;
};

Eigen::Matrix3d headRotation(const HeadAngles& angles);

// The inverse of headRotation. `rotation` must be a rotation matrix; at pitch = +-pi/2 yaw takes the whole turn and
// roll is 0.
HeadAngles headAngles(const Eigen::Matrix3d& rotation);

// Fills quaternion (w >= 0), angles, translation and `observed = true`.
void setHeadPose(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation_camera_mm, HeadPose& out);

// From one pose (0) to the other (1), the shorter way; angles as those of the quaternion. `observed` is left alone.
void mixHeadPose(const HeadPose& from, const HeadPose& to, float share, HeadPose& out);

}  // namespace volto::tracker
