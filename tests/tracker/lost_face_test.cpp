// What the tracker does without a face, and with points that are none.
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "tests/tracker/synthetic_actor.h"
#include "tracker/tracker.h"

namespace volto::tracker {
namespace {

using test::expression;
using test::SyntheticActor;
using test::weightOf;

constexpr double kFrame_s = 1.0 / 30;

class Smiling : public ::testing::Test {
 protected:
  Smiling() {
    std::vector<LandmarkFrame> rest;
    for (int i = 0; i < 30; ++i) rest.push_back(actor.frame(i * kFrame_s, {}));
    tracker.setNeutral(neutralFromRest(rest, options));
    for (int i = 0; i < 60; ++i) smile();
  }

  void smile() { push(actor.frame(time_s, expression({{"mouthSmileLeft", 0.8F}, {"mouthSmileRight", 0.8F}}))); }
  void nobody() {
    LandmarkFrame frame;
    frame.t_capture_ns = std::llround(time_s * 1e9);
    push(frame);
  }
  void push(const LandmarkFrame& frame) {
    tracker.push(frame, mask);
    time_s += kFrame_s;
    ASSERT_TRUE(test::allFinite(mask)) << "at " << time_s;
  }

  static constexpr TrackerOptions options{.use_3d = false};
  SyntheticActor actor;
  Tracker tracker{options};
  MaskFrame mask;
  double time_s = 0;
};

TEST_F(Smiling, ALostFaceIsHeldThenEasedToNeutral) {
  const float before = weightOf(mask, "mouthSmileLeft");
  ASSERT_GT(before, 0.5);
  const auto place = mask.head.translation_mm;
  for (int i = 0; i < 5; ++i) {
    nobody();
    EXPECT_EQ(mask.state, TrackingState::holding);
    EXPECT_EQ(weightOf(mask, "mouthSmileLeft"), before);
  }
  float last = before;
  bool eased = false;
  for (int i = 0; i < 40; ++i) {
    nobody();
    eased = eased || mask.state == TrackingState::easing;
    EXPECT_LE(weightOf(mask, "mouthSmileLeft"), last);
    EXPECT_LT(last - weightOf(mask, "mouthSmileLeft"), 0.15) << "no jump";
    last = weightOf(mask, "mouthSmileLeft");
  }
  EXPECT_TRUE(eased);
  EXPECT_EQ(mask.state, TrackingState::no_face);
  EXPECT_EQ(mask.confidence, 0);
  EXPECT_EQ(mask.head.translation_mm, place) << "the head stays where it was seen last";
  EXPECT_FALSE(mask.head.observed);
  for (const float w : mask.arkit_weights) EXPECT_EQ(w, 0);
  for (const auto& d : mask.displacement_fapu) EXPECT_EQ(d, (std::array<float, 3>{0, 0, 0}));
}

TEST_F(Smiling, AFaceThatComesBackIsBlendedIn) {
  for (int i = 0; i < 40; ++i) nobody();
  float last = 0;
  for (int i = 0; i < 30; ++i) {
    smile();
    EXPECT_EQ(mask.state, TrackingState::tracking);
    EXPECT_LE(weightOf(mask, "mouthSmileLeft") - last, 0.15F) << "frame " << i;
    last = weightOf(mask, "mouthSmileLeft");
  }
  EXPECT_GT(last, 0.6);
}

TEST_F(Smiling, ALostFaceThatWasTurnedGoesBackUprightAndReturnsWithoutAJump) {
  const test::HeadMotion turned{.yaw_deg = 35, .pitch_deg = 10, .roll_deg = -15};
  for (const bool keep : {false, true}) {
    TrackerOptions wanted = options;
    wanted.keep_head = keep;
    tracker = Tracker(wanted);
    const auto angle = [&] { return 2 * std::acos(std::min(1.0F, mask.head.rotation[3])) * 180 / 3.14159F; };
    for (int i = 0; i < 30; ++i) push(actor.frame(time_s, {}, turned));
    const float seen = angle();
    ASSERT_GT(seen, 25);
    float last = seen;
    const auto noJump = [&](const char* when) {
      EXPECT_LT(std::abs(angle() - last), 7.0F) << when << ", degrees in a frame";
      last = angle();
    };
    for (int i = 0; i < 40; ++i) nobody(), noJump("going");
    EXPECT_NEAR(angle(), keep ? seen : 0, 0.1F);
    EXPECT_EQ(mask.head.yaw_rad == 0, !keep);
    EXPECT_FALSE(mask.head.observed);
    for (int i = 0; i < 30; ++i) push(actor.frame(time_s, {}, turned)), noJump("coming back");
    EXPECT_TRUE(mask.head.observed);
    EXPECT_NEAR(angle(), seen, 2);
  }
}

TEST_F(Smiling, TimeThatDoesNotAdvanceIsAFrameWithoutFace) {
  const std::int64_t now = mask.t_capture_ns;
  LandmarkFrame again = actor.frame(0, {});
  for (const std::int64_t t : {now, now - 1, std::int64_t{0}, std::numeric_limits<std::int64_t>::min()}) {
    again.t_capture_ns = t;
    tracker.push(again, mask);
    EXPECT_EQ(mask.state, TrackingState::holding);
    EXPECT_TRUE(test::allFinite(mask));
  }
  smile();
  EXPECT_EQ(mask.state, TrackingState::tracking);
}

TEST_F(Smiling, AWrongNumberOfPointsIsAFrameWithoutFace) {
  for (const std::size_t count : {0U, 1U, 67U, 69U, 478U}) {
    LandmarkFrame frame = actor.frame(time_s, {});
    frame.points_px.resize(count);
    push(frame);
    EXPECT_NE(mask.state, TrackingState::tracking) << count << " points";
  }
  LandmarkFrame frame = actor.frame(time_s, {});
  frame.point_confidence.assign(5, 1.0F);
  push(frame);
  EXPECT_NE(mask.state, TrackingState::tracking);
}

TEST_F(Smiling, PointsThatAreNoNumbersAreAFrameWithoutFace) {
  for (const float bad : {NAN, INFINITY, -INFINITY, 1e30F}) {
    LandmarkFrame frame = actor.frame(time_s, {});
    for (auto& p : frame.points_px) p = {bad, bad};
    push(frame);
    EXPECT_NE(mask.state, TrackingState::tracking) << bad;
  }
}

TEST(TrackerGarbage, NothingMakesTheOutputInfinite) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> anywhere(-2000, 3000);
  SyntheticActor actor;
  Tracker tracker;
  MaskFrame mask;
  for (int i = 0; i < 1500; ++i) {
    const double t = i * kFrame_s;
    LandmarkFrame frame = actor.frame(t, test::livelyTalk(t), test::livelyHead(t), i % 5 == 0);
    switch (random() % 6) {
      case 0:
        for (auto& p : frame.points_px) p = {anywhere(random), anywhere(random)};
        break;
      case 1:
        for (auto& p : frame.points_px) p = {320, 240};  // all in one place
        for (auto& p : frame.points_camera_mm) p = {0, 0, 0};
        break;
      case 2:
        frame.points_px[random() % 68] = {NAN, INFINITY};
        break;
      case 3:
        frame.focal_length_px = -1;
        frame.image_width_px = frame.image_height_px = 0;
        break;
      default:
        break;
    }
    tracker.push(frame, mask);
    ASSERT_TRUE(test::allFinite(mask)) << "frame " << i;
  }
}

TEST(TrackerGarbage, BeforeTheFirstFaceTheMaskIsNeutral) {
  Tracker tracker;
  MaskFrame mask;
  mask.arkit_weights.fill(0.7F);
  tracker.push({}, mask);
  EXPECT_EQ(mask.state, TrackingState::no_face);
  for (const float w : mask.arkit_weights) EXPECT_EQ(w, 0);
  EXPECT_FALSE(mask.head.observed);
}

TEST(TrackerGarbage, AProfileIsSurvived) {
  SyntheticActor actor;
  Tracker tracker({.use_3d = false});
  MaskFrame mask;
  for (int i = 0; i < 180; ++i) {
    test::HeadMotion head;
    head.yaw_deg = 80 * std::sin(i * 0.05);
    tracker.push(actor.frame(i * kFrame_s, {}, head), mask);
    ASSERT_TRUE(test::allFinite(mask)) << "yaw " << head.yaw_deg;
  }
}

}  // namespace
}  // namespace volto::tracker
