// A script on one character, frame by frame: the same frames wherever they go.
#pragma once

#include <cstdint>

#include "frames/avatar_frame.h"
#include "frames/mask_frame.h"
#include "retarget/face_deformer.h"
#include "retarget/shape_relations.h"
#include "rig/rig.h"
#include "tools/animation/animation_script.h"

namespace volto::animation {

// Thread-bound. Borrows `rig` and `script`. Allocates nothing after the first frame.
class ScriptPlayer {
 public:
  // `rate_hz`: frames a second, > 0. `with_mesh`: also the deformed vertices.
  ScriptPlayer(const rig::Rig& rig, const AnimationScript& script, double rate_hz, bool with_mesh);

  // From the beginning to the end of the script, both included.
  std::uint64_t frameCount() const { return frames_; }
  std::int64_t time(std::uint64_t frame) const;  // nanoseconds from the beginning

  // A combination that the script leaves at 0 follows its parents.
  void play(std::uint64_t frame);
  // Of the last play(); t_capture_ns is time(frame).
  AvatarFrame& avatar() { return avatar_; }
  // What another character would have to do: the mask in FAPU, and the weights of shapes with ARKit names.
  MaskFrame& mask() { return mask_; }

 private:
  const rig::Rig& rig_;
  const AnimationScript& script_;
  double rate_hz_;
  bool with_mesh_;
  std::uint64_t frames_;
  retarget::FaceDeformer deformer_;
  rig::FeaturePointPositions fapu_scale_;  // mesh units per FAPU, of each point and axis in the head frame
  retarget::ShapeRelations relations_;
  std::vector<std::int32_t> arkit_;  // one per shape: index of its ARKit name, or -1
  AnimationScript::Moment moment_;
  AvatarFrame avatar_;
  MaskFrame mask_;
};

}  // namespace volto::animation
