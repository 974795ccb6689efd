// The path of one frame, from landmarks to a character: tracker, then retarget. The same path live, in a replay and in
// a bake.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "frames/avatar_frame.h"
#include "frames/landmark_frame.h"
#include "frames/mask_frame.h"
#include "retarget/retargeter.h"
#include "rig/rig.h"
#include "rig/shape_translation.h"
#include "tools/pipeline/performance.h"
#include "tracker/tracker.h"

namespace volto::pipeline {

struct TrackingOptions {
  tracker::TrackerOptions tracker;
  // The actor's face at rest, where it is known. Else the tracker learns it from the stream as it goes by.
  std::optional<tracker::NeutralFace> neutral;
};

// The neutral that a recording shows when all of it is looked at. Nothing for a performance that needs no tracker.
std::optional<tracker::NeutralFace> neutralOf(const Performance& performance, const tracker::TrackerOptions& options);

// Landmarks to masks. Frames that are masks already pass through. Allocates nothing per frame after the first.
// Thread-bound.
class Tracking {
 public:
  explicit Tracking(TrackingOptions options);

  void push(const LandmarkFrame& in, MaskFrame& out) { tracker_.push(in, out); }
  // Frame number `frame` of a performance, in order.
  void push(const Performance& performance, std::size_t frame, MaskFrame& out);
  // Forgets what was seen: the next frame is the first.
  void restart();
  // From now on this is the actor's face at rest; and what is known of it so far.
  void learn() { tracker_.learn(); }
  void setNeutral(const tracker::NeutralFace& neutral) { tracker_.setNeutral(neutral); }
  tracker::NeutralFace neutral() const { return tracker_.neutral(); }

 private:
  tracker::Tracker makeTracker() const;

  TrackingOptions options_;
  tracker::Tracker tracker_;
};

// ... and on to one character. Same contract; borrows nothing after construction. Weights that were recorded as such
// (Live Link Face) go straight to the character's shapes of the same names, since a mask cannot show all of them
// (tongue, puffed cheeks, gaze).
class FramePath {
 public:
  FramePath(const rig::Rig& rig, TrackingOptions tracking, const retarget::RetargetOptions& retarget = {});

  void push(const LandmarkFrame& in);
  void push(const Performance& performance, std::size_t frame);
  void restart();
  // What the last frame teaches, done now and not before the next one; see tracker/tracker.h.
  void learn() { tracking_.learn(); }
  void setNeutral(const tracker::NeutralFace& neutral) { tracking_.setNeutral(neutral); }
  tracker::NeutralFace neutral() const { return tracking_.neutral(); }
  void setMesh(bool mesh) { retargeter_.setMesh(mesh); }  // see retarget/retargeter.h
  // From now on the avatar's weights are those of another set. The mesh stays as it is.
  void speakAs(rig::ShapeTranslation translation) { translation_ = std::move(translation); }

  // Of the last push; valid until the next.
  MaskFrame& mask() { return mask_; }
  AvatarFrame& avatar() { return avatar_; }
  // When the last push had its mask, and its avatar: monotonic clock, nanoseconds.
  std::int64_t trackedAt() const { return tracked_at_ns_; }
  std::int64_t retargetedAt() const { return retargeted_at_ns_; }

 private:
  void retarget();
  void passWeightsOn();
  void translate();

  Tracking tracking_;
  retarget::Retargeter retargeter_;
  std::optional<rig::ShapeTranslation> translation_;
  AvatarFrame untranslated_;                             // weights and observed only
  std::vector<std::optional<std::size_t>> arkit_index_;  // one per blendshape of the character
  MaskFrame mask_;
  AvatarFrame avatar_;
  std::int64_t tracked_at_ns_ = 0, retargeted_at_ns_ = 0;
};

}  // namespace volto::pipeline
