// AvatarFrame: one moment of one character.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "frames/mask_frame.h"

namespace volto {

struct AvatarFrame {
  std::int64_t t_capture_ns = 0;
  std::uint64_t capture_seq = 0;
  TrackingState state = TrackingState::no_face;
  float confidence = 0.0F;
  HeadPose head;
  Gaze gaze;
  // One per blendshape of the character, in the order of its names (rig or character/ message), 0..1.
  std::vector<float> weights;
  // Same length: 0 where the input cannot show the shape (its weight is then 0 and means nothing).
  std::vector<std::uint8_t> observed;
  // The deformed mesh: #V by 3, the character's own unit, frame and vertex order; head pose not applied. Empty when nobody asked.
  std::vector<std::array<float, 3>> vertices;
};

}  // namespace volto
