#include "tracker/gaze.h"

#include <algorithm>
#include <cmath>

namespace volto::tracker {
namespace {

// Millimetres of an adult eye: the centre of rotation lies 13.5 behind the cornea's front, the iris' plane 3 behind it
// and the corners about 6.5.
constexpr double kIrisDepth_mm = 10.5;  // from the centre of rotation
constexpr double kCornerDepth_mm = 7.0;
constexpr double kFurthest_rad = 0.75;         // eyes turn no further
constexpr OneEuroConstants kFilter{1.5, 6.0};  // radians
// People look at the camera or the screen below it most of the time: a mean direction beside it is the detector's
// error, as far as that goes.
constexpr double kBiasMemory_s = 15, kLargestBias_rad = 0.2;
constexpr double kRemember_s = 0.4;     // after a blink the eyes look where they looked
constexpr double kFullAngle_rad = 0.6;  // eyeLookOut = 1

}  // namespace

std::array<std::array<int, 2>, 2> eyeCorners(LandmarkLayout layout) {
  switch (layout) {
    case LandmarkLayout::ibug68:
    case LandmarkLayout::openseeface66:
      return {{{36, 39}, {45, 42}}};
    case LandmarkLayout::mediapipe478:
      return {{{33, 133}, {263, 362}}};
  }
  return {{{-1, -1}, {-1, -1}}};
}

bool gazeOfEye(const std::array<float, 2>& pupil_px, const std::array<float, 2>& outer_px,
               const std::array<float, 2>& inner_px, const Eigen::Matrix3d& head_rotation, double px_per_mm,
               Gaze::Eye& out) {
  const double x = (pupil_px[0] - 0.5 * (outer_px[0] + inner_px[0])) / px_per_mm;
  const double y = -(pupil_px[1] - 0.5 * (outer_px[1] + inner_px[1])) / px_per_mm;
  // kIrisDepth g = R^T (x, y, t) + kCornerDepth e_z, |g| = 1: a quadratic equation for t; of the two solutions the one
  // towards the camera is the one that is seen.
  const Eigen::Vector3d a =
      head_rotation.transpose() * Eigen::Vector3d(x, y, 0) + Eigen::Vector3d(0, 0, kCornerDepth_mm);
  const Eigen::Vector3d b = head_rotation.row(2).transpose();
  const double ab = a.dot(b);
  double root = ab * ab - a.squaredNorm() + kIrisDepth_mm * kIrisDepth_mm;
  if (!std::isfinite(root)) return false;
  root = std::max(root, 0.0);  // further out than an eye can be: as far as it goes
  const Eigen::Vector3d g = (a + (std::sqrt(root) - ab) * b).normalized();
  if (!(g.z() > 0.2)) return false;
  out.yaw_rad = static_cast<float>(std::clamp(std::atan2(g.x(), g.z()), -kFurthest_rad, kFurthest_rad));
  out.pitch_rad =
      static_cast<float>(std::clamp(std::asin(std::clamp(g.y(), -1.0, 1.0)), -kFurthest_rad, kFurthest_rad));
  return true;
}

void GazeTracker::reset() {
  yaw_.reset();
  pitch_.reset();
  ever_ = false;
  unseen_s_ = 0;
}

void GazeTracker::push(const LandmarkFrame& in, const ViewPose& pose, double focal_length_px, double dt_s,
                       double smoothing, Gaze& out) {
  out = {};
  const auto corners = eyeCorners(in.layout);
  const double distance_mm = -pose.translation.z();
  double yaw = 0, pitch = 0, weight = 0;
  if (distance_mm > 0 && focal_length_px > 0 && in.points_px.size() == landmarkCount(in.layout)) {
    for (std::size_t eye = 0; eye < 2; ++eye) {
      const Pupil& pupil = in.pupils[eye];
      Gaze::Eye look;
      if (!(pupil.confidence > 0) || corners[eye][0] < 0) continue;
      if (!gazeOfEye({pupil.x_px, pupil.y_px}, in.points_px[static_cast<std::size_t>(corners[eye][0])],
                     in.points_px[static_cast<std::size_t>(corners[eye][1])], pose.rotation,
                     focal_length_px / distance_mm, look))
        continue;
      // Both eyes look the same way; one that is turned away from the camera shows it less well.
      yaw += pupil.confidence * look.yaw_rad;
      pitch += pupil.confidence * look.pitch_rad;
      weight += pupil.confidence;
    }
  }
  if (!(weight > 0.02)) {
    unseen_s_ += dt_s;
    if (!ever_ || unseen_s_ > kRemember_s) return;
    out.confidence = static_cast<float>(0.5 * (1 - unseen_s_ / kRemember_s));
    out.left.yaw_rad = out.right.yaw_rad = static_cast<float>(yaw_.value());
    out.left.pitch_rad = out.right.pitch_rad = static_cast<float>(pitch_.value());
    return;
  }
  yaw /= weight;
  pitch /= weight;
  // Where the camera is, seen from the head.
  const Eigen::Vector3d to_camera = -(pose.rotation.transpose() * pose.translation).normalized();
  const double camera_yaw = std::atan2(to_camera.x(), to_camera.z()), camera_pitch = std::asin(to_camera.y());
  seen_s_ += dt_s;
  const double share = 1 - std::exp(-dt_s / std::min(kBiasMemory_s, std::max(seen_s_, 1.0)));
  const auto follow = [&](double& bias, double error) {
    bias = std::clamp(bias + share * std::clamp(error - bias, -kLargestBias_rad, kLargestBias_rad), -kLargestBias_rad,
                      kLargestBias_rad);
  };
  follow(bias_yaw_, yaw - camera_yaw);
  follow(bias_pitch_, pitch - camera_pitch);
  ever_ = true;
  unseen_s_ = 0;
  out.left.yaw_rad = out.right.yaw_rad = static_cast<float>(yaw_.push(yaw - bias_yaw_, dt_s, kFilter, smoothing));
  out.left.pitch_rad = out.right.pitch_rad =
      static_cast<float>(pitch_.push(pitch - bias_pitch_, dt_s, kFilter, smoothing));
  out.confidence = static_cast<float>(std::min(0.5 * weight, 1.0));
}

void lookSideways(const Gaze& gaze, ArkitWeights& weights, ArkitObserved& observed) {
  static const auto in_left = arkitBlendshapeIndex("eyeLookInLeft").value();
  static const auto out_left = arkitBlendshapeIndex("eyeLookOutLeft").value();
  static const auto in_right = arkitBlendshapeIndex("eyeLookInRight").value();
  static const auto out_right = arkitBlendshapeIndex("eyeLookOutRight").value();
  if (!(gaze.confidence > 0)) return;
  const auto part = [](float angle_rad) {
    return std::clamp(angle_rad / static_cast<float>(kFullAngle_rad), 0.0F, 1.0F);
  };
  weights[out_left] = part(gaze.left.yaw_rad);
  weights[in_left] = part(-gaze.left.yaw_rad);
  weights[in_right] = part(gaze.right.yaw_rad);
  weights[out_right] = part(-gaze.right.yaw_rad);
  for (const std::size_t shape : {in_left, out_left, in_right, out_right}) observed[shape] = true;
}

}  // namespace volto::tracker
