// From landmarks to the mask: the actor's expression, apart from the actor's shape and head motion.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "frames/landmark_frame.h"
#include "frames/mask_frame.h"
#include "rig/expression_table.h"

namespace volto::tracker {

// The actor's face at rest. 84 by 3, millimetres (a scale is assumed when the input is 2D only), head frame.
struct NeutralFace {
  rig::FeaturePointPositions positions_mm;
  std::array<float, kFeaturePointCount> confidence{};  // 1 measured, towards 0 as inferred
};

struct TrackerOptions {
  bool use_3d = true;              // false: 2D points only, even where the input has 3D
  double focal_length_px = 0;      // 0: as the input says, else estimated from the image size
  double smoothing = 1.0;          // 0: no filter; more = smoother and later. Scales the per-region filters.
  double hold_s = 0.2;             // a lost face: the last good expression is held so long ...
  double ease_s = 0.5;             // ... and then led back to neutral in so long
};

class Tracker {
 public:
  explicit Tracker(const TrackerOptions& options = {}, const rig::ExpressionTable& table = rig::ExpressionTable::standard());
  ~Tracker();
  Tracker(Tracker&&) noexcept;
  Tracker& operator=(Tracker&&) noexcept;

  // From now on this is the actor's neutral; the stream no longer changes it.
  void setNeutral(const NeutralFace& neutral);
  // What the stream has shown so far.
  NeutralFace neutral() const;

  // One frame in, one frame out, in order of time. Allocates nothing after the first frame of a layout. Output is always finite.
  // A frame whose time does not advance, or whose points are not finite, counts as a lost face.
  void push(const LandmarkFrame& in, MaskFrame& out);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// A second or more of the actor at rest, as a person gives when asked.
NeutralFace neutralFromRest(std::span<const LandmarkFrame> rest, const TrackerOptions& options = {});

// A whole take at once, when there is one: better than what a live stream can know, because it has seen everything.
NeutralFace neutralFromTake(std::span<const LandmarkFrame> take, const TrackerOptions& options = {},
                            const rig::ExpressionTable& table = rig::ExpressionTable::standard());

}  // namespace volto::tracker
