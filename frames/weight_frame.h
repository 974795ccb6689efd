// WeightFrame: one moment of a performance that was recorded as blendshape weights, by a phone or another program.
#pragma once

#include <cstdint>

#include "frames/arkit_blendshapes.h"
#include "frames/mask_frame.h"

namespace volto {

struct WeightFrame {
  std::int64_t t_capture_ns = 0;  // nanoseconds since the start of the recording
  std::uint64_t capture_seq = 0;  // +1 per row of the recording
  bool face_present = false;      // false: the weights are all zero and mean nothing
  ArkitWeights weights{};         // 0..1, always finite
  ArkitObserved observed;         // which shapes the recording holds
  // Angles only (yaw > 0: to the subject's left; pitch > 0: up; roll > 0: toward the subject's right shoulder); the
  // rotation stays identity.
  HeadPose head;
  Gaze gaze;
};

}  // namespace volto
