// Lids calibrated by their own range. A detector's lids hardly ever close: where it draws a closed eye the landmarks
// still stand apart by half of an open one. What a blink of this actor looks like to this detector is learned from
// blinks, which are nearly always complete; from then on that much is a closed eye. Internal to the tracker.
#pragma once

#include "tracker/tracker.h"

namespace volto::tracker {

// One eye. Allocates nothing.
class LidCalibration {
 public:
  // Known from earlier; a range that is empty means nothing is known.
  void start(const LidRange& range);
  const LidRange& range() const { return range_; }
  bool known() const { return known_; }  // a blink has been seen

  // `blink`: the eyeBlink weight as fitted. Returns it as a share of the range, 0..1.
  float push(float blink, double dt_s);

 private:
  void learn(float blink, double dt_s);

  LidRange range_{};
  bool known_ = false;
  // The blink that is under way.
  bool closing_ = false;
  float peak_ = 0;
  double closed_s_ = 0;
};

}  // namespace volto::tracker
