#include "tracker/lid_range.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace volto::tracker {
namespace {

constexpr double kFrame_s = 1.0 / 25;

// A detector that shows `open` for an open eye and `closed` for a closed one; a blink every two seconds.
class Blinker {
 public:
  Blinker(float open, float closed) : open_(open), closed_(closed) {}

  // The highest and the lowest output in a stretch of time.
  std::pair<float, float> watch(LidCalibration& lid, double seconds) {
    float low = 1, high = 0;
    for (int i = 0; i < static_cast<int>(seconds / kFrame_s); ++i, ++frame_) {
      const int phase = frame_ % 50;
      const float share = phase == 20 ? 0.6F : phase == 21 || phase == 22 ? 1.0F : phase == 23 ? 0.5F : 0.0F;
      const float out = lid.push(open_ + share * (closed_ - open_), kFrame_s);
      low = std::min(low, out);
      high = std::max(high, out);
    }
    return {low, high};
  }

 private:
  float open_, closed_;
  int frame_ = 0;
};

TEST(LidCalibration, AfterABlinkAClosedEyeIsClosed) {
  LidCalibration lid;
  Blinker actor(0, 0.45F);
  EXPECT_NEAR(actor.watch(lid, 2).second, 0.45, 0.01) << "the first blink as it is";
  EXPECT_NEAR(actor.watch(lid, 10).second, 1, 0.02);
  EXPECT_NEAR(lid.range().closed, 0.45, 0.02);
}

TEST(LidCalibration, AnOpenEyeThatDoesNotReadZeroBecomesZero) {
  LidCalibration lid;
  Blinker actor(0.1F, 0.7F);
  actor.watch(lid, 90);
  const auto [low, high] = actor.watch(lid, 4);
  EXPECT_NEAR(low, 0, 0.03);
  EXPECT_NEAR(high, 1, 0.03);
}

TEST(LidCalibration, ADetectorThatIsRightIsLeftAlone) {
  LidCalibration lid;
  Blinker actor(0, 1);
  actor.watch(lid, 30);
  const auto [low, high] = actor.watch(lid, 4);
  EXPECT_NEAR(low, 0, 0.01);
  EXPECT_NEAR(high, 1, 0.01);
}

TEST(LidCalibration, NarrowedAndLongClosedEyesAreNoBlinks) {
  LidCalibration lid;
  Blinker(0, 0.8F).watch(lid, 20);
  const float closed = lid.range().closed;
  for (int i = 0; i < 100; ++i) lid.push(0.35F, kFrame_s);  // four seconds of squinting
  for (int i = 0; i < 25; ++i) lid.push(0, kFrame_s);
  EXPECT_EQ(lid.range().closed, closed);
  EXPECT_LT(lid.range().open, 0.15);
}

TEST(LidCalibration, WhatWasKnownIsUsedFromTheFirstBlinkOn) {
  LidCalibration lid;
  lid.start({0.0F, 0.5F});
  EXPECT_NEAR(Blinker(0, 0.5F).watch(lid, 2).second, 1, 0.01);
}

}  // namespace
}  // namespace volto::tracker
