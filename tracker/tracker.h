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

struct Settings;        // tracker/settings.h
class ExpressionPrior;  // tracker/expression_prior.h

// What the detector makes of one of the actor's lids: how far an open and a closed eye's stand apart, as a share of the
// distance between the outer corners of the eyes. Both 0: not known.
struct LidRange {
  float open = 0, closed = 0;
};

// The actor's face at rest. 84 by 3, millimetres (a scale is assumed when the input is 2D only), head frame.
struct NeutralFace {
  rig::FeaturePointPositions positions_mm;
  std::array<float, kFeaturePointCount> confidence{};  // 1 measured, towards 0 as inferred
  // How this actor uses the 52 shapes, as far as a take has shown it: usual weight, and deviation from it. All zero:
  // not known.
  ArkitWeights usual{};
  ArkitWeights deviation{};
  std::array<LidRange, 2> lids{};  // right, left
};

// Smoothing of one region relative to the others. 0: not at all; more = smoother and later.
struct RegionSmoothing {
  double lids = 1.0;
  double brows = 1.0;
  double mouth = 1.0;   // and jaw
  double cheeks = 1.0;  // and nose
  double head = 0.0;    // the pose; recordings of good landmarks need none
  double gaze = 1.0;
};

struct TrackerOptions {
  bool use_3d = true;          // false: 2D points only, even where the input has 3D
  double focal_length_px = 0;  // 0: as the input says, else guessed from the image size
  double smoothing = 1.0;      // 0: no filter; more = smoother and later. Scales all regions.
  RegionSmoothing regions{};
  double hold_s = 0.2;     // a lost face: the last good expression and pose are held so long ...
  double ease_s = 0.5;     // ... and then led back to neutral and upright in so long
  bool keep_head = false;  // ... but the head stays turned as it was seen last
  // The landmarks come from a detector that looked at pixels (tracker/detector_noise.h): what people usually do counts
  // for more against its noise and bias, and the lids' range is learned from blinks (tracker/lid_range.h).
  bool from_pixels = false;
};

// One face of one stream. One thread at a time; two trackers share nothing. The same frames give the same output to the
// bit.
class Tracker {
 public:
  explicit Tracker(const TrackerOptions& options = {},
                   const rig::ExpressionTable& table = rig::ExpressionTable::standard());
  // With constants and statistics of one's own, for measuring them. `expression` must outlive the tracker.
  Tracker(const TrackerOptions& options, const rig::ExpressionTable& table, const Settings& settings,
          const ExpressionPrior& expression);
  ~Tracker();
  Tracker(Tracker&&) noexcept;
  Tracker& operator=(Tracker&&) noexcept;

  // From now on this is the actor's neutral; the stream no longer changes it. Position and rotation do not matter, and
  // size only for 3D input. Throws std::invalid_argument when a position is not finite or the face has no extent.
  void setNeutral(const NeutralFace& neutral);
  // What the stream has shown so far; the mean face before that.
  NeutralFace neutral() const;

  // One frame in, one frame out, in order of time. Allocates nothing after the first frame of a layout. Output is
  // always finite. A frame whose time does not advance, that has arrays of the wrong length, or of whose points more
  // than a quarter are not finite, counts as a lost face; a few bad points are bridged by the others. Throws
  // std::invalid_argument for a layout that the tracker does not know (tracker/landmark_layout.h).
  void push(const LandmarkFrame& in, MaskFrame& out);

  // What the last frame teaches about this actor's neutral (a good half of the work) is left for after it: call this
  // once the frame is on its way. The next push() does it first where nobody has, so the output is the same either way.
  void learn();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// A second or more of the actor at rest, as a person gives when asked. Frames that move (a blink) are left out. Throws
// std::invalid_argument when no frame shows a face, or for an unknown layout.
NeutralFace neutralFromRest(std::span<const LandmarkFrame> rest, const TrackerOptions& options = {});

// A whole take at once, when there is one: better than what a live stream can know, because it has seen everything.
// Throws std::invalid_argument when no frame shows a face, or for an unknown layout.
NeutralFace neutralFromTake(std::span<const LandmarkFrame> take, const TrackerOptions& options = {},
                            const rig::ExpressionTable& table = rig::ExpressionTable::standard());

}  // namespace volto::tracker
