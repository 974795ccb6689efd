// Gaze from where the pupils are between the corners of the eyes. Internal to the tracker.
//
// The eyeball turns about a centre behind the eye's corners; the iris lies kIrisDepth_mm from it. What the camera sees
// of the pupil against the middle of the corners gives two equations for the direction, its length the third. Only
// differences of measured points are used, so an error of the head's place does not matter.
#pragma once

#include <array>

#include "frames/landmark_frame.h"
#include "frames/mask_frame.h"
#include "tracker/frame_fit.h"
#include "tracker/one_euro.h"

namespace volto::tracker {

// Landmarks at the outer and inner corner of the subject's right and left eye; -1: the layout has none.
std::array<std::array<int, 2>, 2> eyeCorners(LandmarkLayout layout);

// One eye: direction in the head frame. False when no eye can stand like that. `pupil_px` and `corners_px` in the
// image; `px_per_mm` at the head.
bool gazeOfEye(const std::array<float, 2>& pupil_px, const std::array<float, 2>& outer_px,
               const std::array<float, 2>& inner_px, const Eigen::Matrix3d& head_rotation, double px_per_mm,
               Gaze::Eye& out);

// Both eyes over time. Allocates nothing.
class GazeTracker {
 public:
  void reset();
  // A frame without pupils (a blink) keeps the last direction for a moment, with falling confidence.
  void push(const LandmarkFrame& in, const ViewPose& pose, double focal_length_px, double dt_s, double smoothing,
            Gaze& out);

 private:
  OneEuro yaw_, pitch_;
  double bias_yaw_ = 0, bias_pitch_ = 0;  // of this detector on this actor
  double seen_s_ = 0, unseen_s_ = 0;
  bool ever_ = false;
};

// The eyeLookIn and eyeLookOut weights that say the same.
void lookSideways(const Gaze& gaze, ArkitWeights& weights, ArkitObserved& observed);

}  // namespace volto::tracker
