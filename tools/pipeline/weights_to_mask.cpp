#include "tools/pipeline/weights_to_mask.h"

#include "tracker/head_pose.h"

namespace volto::pipeline {

void maskFromWeights(const WeightFrame& in, const rig::ExpressionTable& table, MaskFrame& out) {
  out = MaskFrame{};
  out.t_capture_ns = in.t_capture_ns;
  out.capture_seq = in.capture_seq;
  if (!in.face_present) return;
  out.state = TrackingState::tracking;
  out.confidence = 1.0F;
  table.apply(in.weights, out.displacement_fapu);
  out.point_confidence.fill(1.0F);
  if (in.head.observed) {
    // A WeightFrame counts pitch upward, head_pose.h downward.
    const tracker::HeadAngles angles{in.head.yaw_rad, -in.head.pitch_rad, in.head.roll_rad};
    tracker::setHeadPose(tracker::headRotation(angles), Eigen::Vector3d::Zero(), out.head);
  }
  out.gaze = in.gaze;
  out.arkit_weights = in.weights;
  out.arkit_observed = in.observed;
}

}  // namespace volto::pipeline
