#include "tracker/tracker.h"

#include <cmath>
#include <cstring>
#include <numbers>
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/tracker/synthetic_actor.h"

namespace volto::tracker {
namespace {

using test::expression;
using test::HeadMotion;
using test::SyntheticActor;
using test::weightOf;

constexpr double kFrame_s = 1.0 / 60;

// An actor in front of a tracker that was shown a second of the actor at rest.
class KnownActor : public ::testing::Test {
 protected:
  KnownActor() {
    std::vector<LandmarkFrame> rest;
    for (int i = 0; i < 60; ++i) rest.push_back(actor.frame(i * kFrame_s, {}, {}));
    tracker.setNeutral(neutralFromRest(rest, options));
  }

  void show(const ArkitWeights& weights, const HeadMotion& head = {}, double seconds = kFrame_s) {
    for (double end = time_s + seconds; time_s < end - 1e-9; time_s += kFrame_s)
      tracker.push(actor.frame(time_s, weights, head), mask);
  }

  static constexpr TrackerOptions options{.use_3d = false};
  SyntheticActor actor;
  Tracker tracker{options};
  MaskFrame mask;
  double time_s = 0;
};

TEST_F(KnownActor, SmileGivesSmile) {
  show(expression({{"mouthSmileLeft", 0.7F}, {"mouthSmileRight", 0.7F}}), {}, 1);
  EXPECT_EQ(mask.state, TrackingState::tracking);
  EXPECT_NEAR(weightOf(mask, "mouthSmileLeft"), 0.7, 0.15);
  EXPECT_NEAR(weightOf(mask, "mouthSmileRight"), 0.7, 0.15);
  EXPECT_LT(weightOf(mask, "mouthFrownLeft"), 0.15);
  EXPECT_LT(weightOf(mask, "jawOpen"), 0.1);
  const std::size_t corner = rig::featurePointIndex("8.3").value();
  EXPECT_GT(mask.displacement_fapu[corner][0], 0.02);  // outward
  EXPECT_GT(mask.displacement_fapu[corner][1], 0.1);   // and up
}

TEST_F(KnownActor, RestIsNeutral) {
  show({}, {}, 1);
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k)
    EXPECT_LT(mask.arkit_weights[k], 0.2) << kArkitBlendshapeNames[k];
}

TEST_F(KnownActor, OneEyeCanBlinkAlone) {
  show({}, {}, 0.5);
  show(expression({{"eyeBlinkLeft", 0.9F}}), {}, 0.4);
  EXPECT_GT(weightOf(mask, "eyeBlinkLeft"), 0.6);
  EXPECT_LT(weightOf(mask, "eyeBlinkRight"), 0.2);
}

TEST_F(KnownActor, ABlinkOfATenthOfASecondSurvivesTheFilters) {
  show({}, {}, 1);
  float peak = 0;
  for (int i = 0; i < 12; ++i) {
    const float closed = i < 6 ? static_cast<float>(std::sin(std::numbers::pi * (i + 1) / 7)) : 0.0F;
    show(expression({{"eyeBlinkLeft", closed}, {"eyeBlinkRight", closed}}));
    peak = std::max(peak, weightOf(mask, "eyeBlinkLeft"));
  }
  EXPECT_GT(peak, 0.65);
  EXPECT_LT(weightOf(mask, "eyeBlinkLeft"), 0.25) << "the lid must be up again";
}

TEST_F(KnownActor, HeadTurnLeavesExpressionUnchanged) {
  const ArkitWeights smile = expression({{"mouthSmileLeft", 0.5F}, {"mouthSmileRight", 0.5F}, {"browInnerUp", 0.4F}});
  show(smile, {}, 1);
  for (double turn = 0; turn < 2 * std::numbers::pi; turn += 0.02) {
    HeadMotion head;
    head.yaw_deg = 22 * std::sin(turn);
    head.pitch_deg = 10 * std::sin(2 * turn);
    head.roll_deg = 8 * std::sin(turn);
    show(smile, head);
    EXPECT_NEAR(weightOf(mask, "mouthSmileLeft"), 0.5, 0.2) << "yaw " << head.yaw_deg;
    EXPECT_NEAR(weightOf(mask, "browInnerUp"), 0.4, 0.2) << "yaw " << head.yaw_deg;
    EXPECT_LT(weightOf(mask, "jawOpen"), 0.1) << "yaw " << head.yaw_deg;
    EXPECT_LT(weightOf(mask, "mouthLeft"), 0.15) << "yaw " << head.yaw_deg;
  }
}

TEST_F(KnownActor, HeadPoseIsRecovered) {
  for (const double yaw : {-25.0, 0.0, 25.0})
    for (const double pitch : {-12.0, 0.0, 12.0}) {
      HeadMotion head;
      head.yaw_deg = yaw;
      head.pitch_deg = pitch;
      head.roll_deg = 7;
      head.at_mm = {40, -25, 700};
      show(expression({{"jawOpen", 0.4F}}), head, 0.2);
      EXPECT_NEAR(mask.head.yaw_rad * 180 / std::numbers::pi, yaw, 2.0);
      EXPECT_NEAR(mask.head.pitch_rad * 180 / std::numbers::pi, pitch, 2.0);
      EXPECT_NEAR(mask.head.roll_rad * 180 / std::numbers::pi, 7, 1.0);
      // Size and distance cannot be told apart in 2D; the direction can.
      EXPECT_NEAR(mask.head.translation_mm[0] / mask.head.translation_mm[2], 40.0 / 700, 0.01);
      EXPECT_NEAR(mask.head.translation_mm[1] / mask.head.translation_mm[2], -25.0 / 700, 0.01);
    }
}

TEST_F(KnownActor, AHeadThatJumpsIsFoundAgainAtOnce) {
  show({}, {}, 0.5);
  HeadMotion head;
  head.yaw_deg = -20;
  head.roll_deg = 40;
  head.at_mm = {-150, 80, 900};
  show({}, head, 0.1);
  EXPECT_EQ(mask.state, TrackingState::tracking);
  EXPECT_NEAR(mask.head.roll_rad * 180 / std::numbers::pi, 40, 2);
}

TEST_F(KnownActor, AFewPointsGoneAstrayDoNotMoveTheFace) {
  show({}, {}, 0.5);
  LandmarkFrame frame = actor.frame(time_s, {});
  frame.points_px[30] = {10, 10};
  frame.points_px[8] = {NAN, 5};
  frame.points_px[45][1] = INFINITY;
  tracker.push(frame, mask);
  EXPECT_EQ(mask.state, TrackingState::tracking);
  EXPECT_TRUE(test::allFinite(mask));
  EXPECT_LT(std::abs(mask.head.yaw_rad), 0.06);
  EXPECT_LT(weightOf(mask, "jawOpen"), 0.15);
}

TEST_F(KnownActor, ThreeDimensionsGiveTheTrueDistance) {
  SyntheticActor other(5, 0.0);
  Tracker tracker3d;
  for (int i = 0; i < 60; ++i)
    tracker3d.push(other.frame(i * kFrame_s, test::livelyTalk(i * kFrame_s), {}, true), mask);
  EXPECT_NEAR(mask.head.translation_mm[2], 650, 15);
  EXPECT_TRUE(mask.arkit_observed[arkitBlendshapeIndex("jawForward").value()]);
}

TEST(TrackerNeutral, IsFoundThoughTheTakeBeginsWithASmile) {
  SyntheticActor actor;
  std::vector<LandmarkFrame> take;
  std::vector<ArkitWeights> truth;
  for (int i = 0; i < 900; ++i) {
    const double t = i / 30.0;
    truth.push_back(t < 2 ? expression({{"mouthSmileLeft", 0.7F}, {"mouthSmileRight", 0.7F}, {"jawOpen", 0.2F}})
                          : test::livelyTalk(t));
    take.push_back(actor.frame(t, truth.back(), test::livelyHead(t)));
  }
  const TrackerOptions options{.use_3d = false};
  const auto errors = [&](Tracker& tracker, std::size_t from) {
    MaskFrame mask;
    const std::size_t smile = arkitBlendshapeIndex("mouthSmileLeft").value(),
                      jaw = arkitBlendshapeIndex("jawOpen").value();
    std::array<double, 2> sum{};
    for (std::size_t i = 0; i < take.size(); ++i) {
      tracker.push(take[i], mask);
      if (i < from) continue;
      sum[0] += std::abs(mask.arkit_weights[smile] - truth[i][smile]);
      sum[1] += std::abs(mask.arkit_weights[jaw] - truth[i][jaw]);
    }
    const auto n = static_cast<double>(take.size() - from);
    return std::array<double, 2>{sum[0] / n, sum[1] / n};
  };
  Tracker seen_all(options);
  seen_all.setNeutral(neutralFromTake(take, options));
  const auto offline = errors(seen_all, 0);
  EXPECT_LT(offline[0], 0.1) << "smile, the whole take seen";
  EXPECT_LT(offline[1], 0.05) << "jaw, the whole take seen";
  Tracker live(options);
  const auto causal = errors(live, 450);  // after 15 s
  EXPECT_LT(causal[0], 0.15) << "smile, live";
  EXPECT_LT(causal[1], 0.07) << "jaw, live";
}

TEST(TrackerNeutral, ABlinkDuringTheSecondOfRestIsLeftOut) {
  SyntheticActor a(1), b(1);
  std::vector<LandmarkFrame> still, blinking;
  for (int i = 0; i < 60; ++i) {
    still.push_back(a.frame(i * kFrame_s, {}));
    const float closed = i >= 20 && i < 30 ? 0.9F : 0.0F;
    blinking.push_back(b.frame(i * kFrame_s, expression({{"eyeBlinkLeft", closed}, {"eyeBlinkRight", closed}})));
  }
  const NeutralFace one = neutralFromRest(still), other = neutralFromRest(blinking);
  EXPECT_LT((one.positions_mm - other.positions_mm).cwiseAbs().maxCoeff(), 0.8);
}

TEST(TrackerNeutral, WhatCannotBeANeutralIsRefused) {
  Tracker tracker;
  NeutralFace face = tracker.neutral();
  face.positions_mm(3, 1) = NAN;
  EXPECT_THROW(tracker.setNeutral(face), std::invalid_argument);
  face.positions_mm.setConstant(7);
  EXPECT_THROW(tracker.setNeutral(face), std::invalid_argument);
  EXPECT_THROW(neutralFromRest({}), std::invalid_argument);
  EXPECT_THROW(neutralFromTake({}), std::invalid_argument);
  std::vector<LandmarkFrame> nobody(5);
  EXPECT_THROW(neutralFromTake(nobody), std::invalid_argument);
  std::vector<LandmarkFrame> one_point(5);
  for (LandmarkFrame& f : one_point) {
    f.face_present = true;
    f.points_px.assign(68, {100, 100});
  }
  EXPECT_THROW(neutralFromTake(one_point), std::invalid_argument);
}

TEST(TrackerLayouts, SixtySixPointsTrackToo) {
  SyntheticActor actor;
  Tracker tracker({.use_3d = false});
  MaskFrame mask;
  HeadMotion head;
  head.yaw_deg = 10;
  for (int i = 0; i < 120; ++i)
    tracker.push(actor.frame66(i * kFrame_s, expression({{"jawOpen", i < 60 ? 0.0F : 0.5F}}), head), mask);
  EXPECT_EQ(mask.state, TrackingState::tracking);
  EXPECT_GT(weightOf(mask, "jawOpen"), 0.3);
  EXPECT_NEAR(mask.head.yaw_rad * 180 / std::numbers::pi, 10, 3);
}

TEST(TrackerLayouts, AnUnknownLayoutIsRefusedByName) {
  Tracker tracker;
  LandmarkFrame frame;
  frame.layout = static_cast<LandmarkLayout>(9);
  MaskFrame mask;
  EXPECT_THROW(tracker.push(frame, mask), std::invalid_argument);
}

TEST(TrackerReplay, IsTheSameToTheBit) {
  SyntheticActor a(9), b(9);
  Tracker one, two;
  for (int i = 0; i < 400; ++i) {
    const double t = i / 30.0;
    MaskFrame first, second;
    one.push(a.frame(t, test::livelyTalk(t), test::livelyHead(t)), first);
    two.push(b.frame(t, test::livelyTalk(t), test::livelyHead(t)), second);
    ASSERT_EQ(std::memcmp(&first.displacement_fapu, &second.displacement_fapu, sizeof first.displacement_fapu), 0)
        << "frame " << i;
    ASSERT_EQ(std::memcmp(&first.arkit_weights, &second.arkit_weights, sizeof first.arkit_weights), 0) << "frame " << i;
    ASSERT_EQ(std::memcmp(&first.head.rotation, &second.head.rotation, sizeof first.head.rotation), 0) << "frame " << i;
  }
}

}  // namespace
}  // namespace volto::tracker
