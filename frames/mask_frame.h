// MaskFrame: an actor's expression with the actor's shape and head motion taken out. The same for every character.
#pragma once

#include <array>
#include <cstdint>

#include "frames/arkit_blendshapes.h"

namespace volto {

inline constexpr std::size_t kFeaturePointCount = 84;  // rig/feature_points.h says which

// Displacement of each feature point from neutral, head frame (+x subject's left, +y up, +z out of the face), each axis
// divided by the FAPU of that point's axis (rig/fapu.h). Row i is feature point i.
using MaskDisplacements = std::array<std::array<float, 3>, kFeaturePointCount>;

// Where the head is. Camera frame: x right, y down, z away from the camera.
struct HeadPose {
  // Unit quaternion x, y, z, w of R in p_camera = diag(1, -1, -1) R p_head + translation: turns about the axes of an upright head that
  // faces the camera (tracker/head_pose.h). Identity = a head that looks straight into an upright camera.
  std::array<float, 4> rotation{0.0F, 0.0F, 0.0F, 1.0F};
  // The same as angles; signs and order as tracker/head_pose.h defines and tests.
  float yaw_rad = 0.0F, pitch_rad = 0.0F, roll_rad = 0.0F;
  std::array<float, 3> translation_mm{0.0F, 0.0F, 0.0F};  // head origin in the camera frame; a scale is assumed for 2D input
  bool observed = false;
};

// Where the eyes look, relative to the head. yaw > 0: to the subject's left; pitch > 0: up.
struct Gaze {
  struct Eye {
    float yaw_rad = 0.0F, pitch_rad = 0.0F;
  };
  Eye left, right;
  float confidence = 0.0F;  // 0: not observed
};

// do not change the values: they are on the wire.
enum class TrackingState : std::uint8_t {
  no_face = 0,   // nothing to see for long enough that the mask is at neutral
  tracking = 1,  // measured in this frame
  holding = 2,   // face lost a moment ago: the last good expression is held
  easing = 3,    // ... then led back to neutral
};

struct MaskFrame {
  std::int64_t t_capture_ns = 0;
  std::uint64_t capture_seq = 0;
  TrackingState state = TrackingState::no_face;
  float confidence = 0.0F;                                      // 0..1 for the frame as a whole
  MaskDisplacements displacement_fapu{};                        // always finite
  std::array<float, kFeaturePointCount> point_confidence{};     // 1 measured, in between inferred from the table, 0 unknown
  HeadPose head;
  Gaze gaze;
  // The expression in ARKit terms, as the tracker's own fit (or the recorded weights) says; a prior for the retarget stage.
  ArkitWeights arkit_weights{};
  ArkitObserved arkit_observed;                                 // a shape that the input cannot show is not observed
};

}  // namespace volto
