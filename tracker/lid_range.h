// Lids by their own range. A detector's lids hardly ever close: where it draws a closed eye the landmarks stand apart
// by half of an open one and more, and a fit that knows that blinks are rare explains even that away. So on pixels a
// blink is read off the opening of the eye itself: between what is open for this actor and what a blink looks like to
// this detector, which is learned from blinks. Internal to the tracker.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "frames/landmark_frame.h"
#include "tracker/tracker.h"

namespace volto::tracker {

// How far the lids of the subject's right (0) or left (1) eye stand apart, as a share of the distance between the outer
// corners of the eyes, both as seen from the front of the head (head_rotation: head to view, y up). Nothing when the
// head is turned too far away, when points are missing, or for a layout without lids.
std::optional<float> eyeOpening(const LandmarkFrame& frame, std::size_t eye, const Eigen::Matrix3d& head_rotation);

// One eye. Allocates nothing.
class LidCalibration {
 public:
  // Known from earlier; a range that is empty changes nothing.
  void start(const LidRange& range);
  const LidRange& range() const { return range_; }

  // `opening` as eyeOpening() says. Returns how far the eye is closed, 0..1.
  float push(float opening, double dt_s);
  // The eye is not seen: as it was.
  float last() const { return last_; }

 private:
  void learn(float opening, double dt_s);

  LidRange range_{};
  float last_ = 0;
  double seen_s_ = 0;
  // The blink that is under way.
  bool closing_ = false;
  float lowest_ = 0;
  double closed_s_ = 0;
};

}  // namespace volto::tracker
