// What moves on a character over a stretch of time, as an animation file wants it: weights, and rotations of head and
// eyes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "frames/avatar_frame.h"
#include "rig/rig.h"

namespace volto::exporter {

using Quaternion = std::array<float, 4>;  // x, y, z, w; unit

// One entry per frame in each list. Rotations are in the mesh frame, relative to neutral; neighbours never differ in
// sign.
struct Movement {
  std::vector<double> time_s;  // increasing, from 0
  std::vector<float> weights;  // frames by blendshapes
  std::vector<Quaternion> head, left_eye, right_eye;
  bool head_moves = false, left_eye_moves = false, right_eye_moves = false;

  std::size_t frameCount() const { return time_s.size(); }
};

// Collects a Movement from avatar frames. Thread-bound; borrows the rig.
class MovementRecorder {
 public:
  explicit MovementRecorder(const rig::Rig& rig) : rig_(rig) {}

  // Frames come in order, with rising times (one that does not rise is passed over, since no animation file can hold
  // it). The eyes are read off the deformed vertices where there are any, so that they turn as they do everywhere else;
  // else off the gaze.
  void add(const AvatarFrame& avatar, std::int64_t t_ns);

  const Movement& movement() const { return movement_; }

 private:
  Quaternion eyeRotation(bool left, const AvatarFrame& avatar) const;

  const rig::Rig& rig_;
  std::int64_t first_ns_ = 0, last_ns_ = 0;
  Movement movement_;
};

}  // namespace volto::exporter
