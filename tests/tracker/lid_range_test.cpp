#include "tracker/lid_range.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "tests/tracker/synthetic_actor.h"

namespace volto::tracker {
namespace {

constexpr double kFrame_s = 1.0 / 25;
constexpr float kOpen = 0.11F;

// A detector that shows `closed` of an open eye's opening for a closed one; a blink every two seconds.
class Blinker {
 public:
  explicit Blinker(float closed, float open = kOpen) : open_(open), closed_(closed * open) {}

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

TEST(LidCalibration, ADetectorThatHardlyClosesItsEyesClosesThemFromTheFirstBlinkOn) {
  LidCalibration lid;
  const auto [low, high] = Blinker(0.6F).watch(lid, 2);
  EXPECT_EQ(low, 0);
  EXPECT_EQ(high, 1);
}

TEST(LidCalibration, ADetectorThatClosesThemMoreOrLessIsLearned) {
  for (const float closed : {0.1F, 0.4F, 0.7F}) {
    LidCalibration lid;
    Blinker actor(closed);
    actor.watch(lid, 40);
    EXPECT_NEAR(lid.range().closed, closed * kOpen, 0.03F * kOpen) << closed;
    const auto [low, high] = actor.watch(lid, 4);
    EXPECT_EQ(low, 0) << closed;
    EXPECT_GT(high, 0.95) << closed;
    const float half = lid.push(0.5F * (1 + closed) * kOpen, kFrame_s);
    EXPECT_GT(half, 0.15) << closed;
    EXPECT_LT(half, 0.6) << closed;
  }
}

TEST(LidCalibration, AStreamThatBeginsWithAClosedEyeIsUnderstoodWithinASecond) {
  LidCalibration lid;
  for (int i = 0; i < 5; ++i) lid.push(0.6F * kOpen, kFrame_s);
  for (int i = 0; i < 25; ++i) lid.push(kOpen, kFrame_s);
  EXPECT_NEAR(lid.range().open, kOpen, 0.02 * kOpen);
  EXPECT_GT(lid.push(0.6F * kOpen, kFrame_s), 0.9);
}

TEST(LidCalibration, AnOpenEyeThatShakesStaysOpen) {
  LidCalibration lid;
  for (int i = 0; i < 200; ++i)
    EXPECT_EQ(lid.push(kOpen * (1 + 0.06F * static_cast<float>(std::sin(1.7 * i))), kFrame_s), 0);
}

TEST(LidCalibration, NarrowedAndLongClosedEyesAreNoBlinks) {
  LidCalibration lid;
  Blinker actor(0.5F);
  actor.watch(lid, 20);
  const LidRange before = lid.range();
  for (int i = 0; i < 100; ++i) lid.push(0.7F * kOpen, kFrame_s);  // four seconds of squinting
  for (int i = 0; i < 25; ++i) lid.push(kOpen, kFrame_s);
  EXPECT_NEAR(lid.range().closed / lid.range().open, before.closed / before.open, 0.03);
  EXPECT_NEAR(lid.range().open, kOpen, 0.08 * kOpen);
}

TEST(LidCalibration, WhatWasKnownIsUsedAndNothingKnownChangesNothing) {
  LidCalibration lid;
  lid.start({0.1F, 0.03F});
  EXPECT_EQ(lid.range().closed, 0.03F);
  lid.start({});
  lid.start({0.1F, 0.5F});  // closed wider than open: of another kind
  EXPECT_EQ(lid.range().open, 0.1F);
}

LandmarkFrame actorsFrame(float blink, const test::HeadMotion& head, bool openseeface = false) {
  test::SyntheticActor actor(1, 0);
  const ArkitWeights weights = test::expression({{"eyeBlinkLeft", blink}});
  return openseeface ? actor.frame66(0, weights, head) : actor.frame(0, weights, head);
}

TEST(EyeOpening, OneEyeClosesAndTheOtherDoesNot) {
  const Eigen::Matrix3d straight = Eigen::Matrix3d::Identity();
  for (const bool openseeface : {false, true}) {
    const LandmarkFrame open = actorsFrame(0, {}, openseeface), wink = actorsFrame(1, {}, openseeface);
    const float at_rest = eyeOpening(open, 1, straight).value();
    EXPECT_GT(at_rest, 0.06);
    EXPECT_LT(at_rest, 0.16);
    EXPECT_LT(eyeOpening(wink, 1, straight).value(), 0.25F * at_rest);
    EXPECT_NEAR(eyeOpening(wink, 0, straight).value(), eyeOpening(open, 0, straight).value(), 0.02F * at_rest);
  }
}

TEST(EyeOpening, ATurnedHeadsEyesAreAsWideOpen) {
  const float straight = eyeOpening(actorsFrame(0, {}), 1, Eigen::Matrix3d::Identity()).value();
  for (const test::HeadMotion& head : {test::HeadMotion{.yaw_deg = 30}, {.pitch_deg = 15}, {.roll_deg = 40}}) {
    constexpr double kRadians = 0.0174533;
    // As the actor turns it; the view's y points up.
    const Eigen::Matrix3d rotation = (Eigen::AngleAxisd(head.yaw_deg * kRadians, Eigen::Vector3d::UnitY()) *
                                      Eigen::AngleAxisd(head.pitch_deg * kRadians, Eigen::Vector3d::UnitX()) *
                                      Eigen::AngleAxisd(head.roll_deg * kRadians, Eigen::Vector3d::UnitZ()))
                                         .toRotationMatrix();
    for (const std::size_t eye : {0U, 1U})
      EXPECT_NEAR(eyeOpening(actorsFrame(0, head), eye, rotation).value(), straight, 0.1F * straight)
          << head.yaw_deg << " " << head.pitch_deg << " " << head.roll_deg;
  }
}

TEST(EyeOpening, AProfileAndMissingPointsSayNothing) {
  const Eigen::Matrix3d profile = Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitY()).toRotationMatrix();
  EXPECT_FALSE(eyeOpening(actorsFrame(0, {}), 0, profile).has_value());
  LandmarkFrame frame = actorsFrame(0, {});
  frame.points_px[38][1] = NAN;
  EXPECT_FALSE(eyeOpening(frame, 0, Eigen::Matrix3d::Identity()).has_value());
  frame.points_px.clear();
  EXPECT_FALSE(eyeOpening(frame, 0, Eigen::Matrix3d::Identity()).has_value());
}

}  // namespace
}  // namespace volto::tracker
