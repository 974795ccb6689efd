// Contacts by themselves, on a few vertices each.
#include "rig/contacts.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "rig/build_rig.h"
#include "rig/pose.h"
#include "rig/rig_file.h"
#include "tests/rig/test_head.h"

namespace volto::rig {
namespace {

using P = std::array<float, 3>;

float length(const P& p) { return std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]); }

// A ball of radius 1 at the origin; vertex 0 is the upper lid, 1 the lower, 2 a lash on the upper; 3 and 4 their
// corners.
struct Eye {
  std::vector<P> neutral = {{0, 0.6F, 0.9F}, {0, -0.6F, 0.9F}, {0, 0.8F, 1.3F}, {-1, 0, 0.5F}, {1, 0, 0.5F}};
  Contacts contacts;

  Eye() {
    BallContact ball;
    ball.radius = 1;
    ball.vertex = {0, 1};
    for (const std::uint32_t v : ball.vertex) ball.distance.push_back(length(neutral[v]) * (1 - 1e-6F));
    contacts.balls = {ball};
    SlitContact slit;
    slit.place = SlitContact::Place::left_eye;
    slit.ball = 0;
    slit.up = {0, 1, 0};
    slit.upper_share = 0.8F;
    slit.upper = {{3, 3, 0}, {0, 0, 0}, {4, 4, 0}};
    slit.lower = {{3, 3, 0}, {1, 1, 0}, {4, 4, 0}};
    slit.least_gap = {0, 0, 0};
    slit.vertex = {0, 1};
    slit.column = {1, 1};
    slit.share = {1, -1};
    slit.reach = {0, 0};
    contacts.slits = {slit};
    contacts.riders = {{2, {0, 0, 0}, {1, 0, 0}, 0}};
  }
  std::vector<P> resolved(std::vector<P> pose) const {
    resolveContacts(contacts, neutral, pose);
    return pose;
  }
};

TEST(Contacts, RestIsLeftAloneToTheBit) {
  const Eye eye;
  EXPECT_EQ(eye.resolved(eye.neutral), eye.neutral);
}

TEST(Contacts, LidThatIsMovedAlongAChordRunsAlongTheBall) {
  const Eye eye;
  auto pose = eye.neutral;
  pose[0] = {0, 0.1F, 0.9F};  // inside the ball's reach
  const auto out = eye.resolved(pose);
  EXPECT_NEAR(length(out[0]), length(eye.neutral[0]), 1e-5F);
  EXPECT_NEAR(out[0][1] / out[0][2], 0.1F / 0.9F, 1e-5F) << "straight out, not to the side";
  EXPECT_EQ(out[1], eye.neutral[1]);
}

TEST(Contacts, LidsMeetAndDoNotPass) {
  const Eye eye;
  auto pose = eye.neutral;
  pose[0][1] = -0.8F;
  pose[1][1] = -0.4F;
  EXPECT_GT(measurePenetration(eye.contacts, pose).lids, 0.3F);
  const auto out = eye.resolved(pose);
  EXPECT_LT(measurePenetration(eye.contacts, out).lids, 0.03F);
  EXPECT_GE(length(out[0]), length(eye.neutral[0]) * 0.999F);
  EXPECT_GT(out[0][1] - pose[0][1], pose[1][1] - out[1][1]) << "the upper lid gives way more";
}

TEST(Contacts, LashTurnsWithItsLid) {
  const Eye eye;
  auto pose = eye.neutral;
  pose[0] = {0, -0.1F, 1.09F};
  const auto out = eye.resolved(pose);
  const P rest = {0, 0.2F, 0.4F}, now = {0, out[2][1] - out[0][1], out[2][2] - out[0][2]};
  EXPECT_NEAR(length(now), length(rest), 1e-4F) << "as long as before";
  EXPECT_LT(now[1], rest[1] - 0.1F) << "and pointing lower";
}

TEST(Contacts, ContactBeginsWithoutAJump) {
  const Eye eye;
  P before{};
  for (int i = 0; i <= 400; ++i) {
    auto pose = eye.neutral;
    pose[0][1] -= 1.6F * static_cast<float>(i) / 400;
    const auto out = eye.resolved(pose);
    if (i > 0) {
      EXPECT_LT(std::hypot(out[0][1] - before[1], out[0][2] - before[2]), 0.02F) << i;
    }
    before = out[0];
  }
}

TEST(Contacts, LidThatIsLiftedOffTheBallComesBackAsFarAsItIsHeld) {
  Eye eye;
  const float at_rest = length(eye.neutral[0]);
  eye.contacts.balls[0].outer = {at_rest, at_rest};
  eye.contacts.balls[0].hold = {1.0F, 0.5F};
  auto pose = eye.neutral;
  for (const std::size_t v : {0U, 1U})
    for (float& x : pose[v]) x *= 1.5F;
  const auto out = eye.resolved(pose);
  EXPECT_NEAR(length(out[0]), at_rest, 1e-5F);
  EXPECT_NEAR(length(out[1]), 1.25F * at_rest, 1e-5F);
}

TEST(Contacts, MarginsAreComparedWhereTheyAreNow) {
  // Two lips along x, each with a step in its height, of which the lower slides by the step's width: what is opposite
  // each other now does not pass, though what was opposite at rest does.
  SlitContact slit;
  slit.up = {0, 1, 0};
  const float step[] = {0, 0, 0, 1, 1, 1, 0, 0, 0};
  std::vector<P> pose;
  for (int side = 0; side < 2; ++side)
    for (int k = 0; k < 9; ++k) {
      const auto v = static_cast<std::uint32_t>(pose.size());
      (side == 0 ? slit.upper : slit.lower).push_back({v, v, 0});
      const bool end = k == 0 || k == 8;
      pose.push_back({static_cast<float>(k) + (side == 1 && !end ? 0.9F : 0.0F), side == 0 ? 0.05F : 0.0F, 0});
    }
  for (std::size_t k = 0; k < 9; ++k) pose[k][1] += step[k];
  // The lower lip's step, after it slid, lies under the upper's.
  for (std::size_t k = 1; k < 8; ++k) pose[9 + k][1] += step[std::min<std::size_t>(8, k + 1)];
  slit.least_gap.assign(9, 0.0F);
  Contacts contacts;
  contacts.slits = {slit};
  EXPECT_LT(measurePenetration(contacts, pose).lips, 0.2F);
  const auto gaps = slitGaps(slit, pose);
  EXPECT_NEAR(gaps[4], 0.05F, 1e-4F);
}

TEST(Contacts, ATriangleThatTurnsOverIsBroughtBack) {
  const std::vector<P> neutral = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 1, 0}};
  Contacts contacts;
  contacts.folds = {{{0, 1, 2}}, 1, {{0, 0, 1}}, {0.01F}, {{{3, 2}}}};
  auto pose = neutral;
  pose[2] = pose[3] = {0.2F, -0.1F, 0};
  resolveContacts(contacts, neutral, pose);
  const float shown = (pose[1][0] - pose[0][0]) * (pose[2][1] - pose[0][1]) -
                      (pose[1][1] - pose[0][1]) * (pose[2][0] - pose[0][0]);
  EXPECT_GE(shown, 0.01F);
  EXPECT_EQ(pose[3], pose[2]) << "what is at the same place stays there";
  auto rest = neutral;
  resolveContacts(contacts, neutral, rest);
  EXPECT_EQ(rest, neutral);
}

class PoseData : public ::testing::Test {
 protected:
  Rig rig_ = [] {
    const volto::test::TestHead head = volto::test::makeTestHead();
    return buildRig(head.mesh, head.points);
  }();
};

TEST_F(PoseData, TravelsInTheRigFile) {
  ASSERT_FALSE(rig_.blendshapes.empty());
  rig_.blendshapes[3].correction = {{1, 4}, {{0.5F, 0, 0}, {0, 1, 2}}};
  rig_.combinations = {{"a + b", Combination::Rule::product, {{0, false}, {1, true}}, {{2}, {{1, 2, 3}}}},
                       {"a beyond b", Combination::Rule::excess, {{0, false}, {1, false}}, {{0}, {{1, 0, 0}}}}};
  rig_.part_motions = {{RigidPart::Follows::jaw, {1, 2, 3}, {0, 5}, {1, 0.5F}, {{2, {0.1F, 0, 0}, {0, 0, 1}}}}};
  rig_.contacts = {};
  rig_.contacts.balls = {{{0, 0, 1}, 2, {3}, {2.5F}, {2.75F}, {0.5F}}};
  rig_.contacts.folds = {{{1, 2, 3}, {2, 3, 4}}, 1, {{0, 0, 1}, {0, 1, 0}}, {0.5F, 0.25F}, {{5, 4}}};
  rig_.contacts.riders = {{7, {1, 2, 3}, {0.25F, 0.25F, 0.5F}, 0}};
  const std::vector<std::byte> bytes = encodeRig(rig_);
  const Rig back = decodeRig(bytes, "t.rig");
  EXPECT_EQ(back.blendshapes[3].correction.vertex, rig_.blendshapes[3].correction.vertex);
  EXPECT_EQ(back.blendshapes[3].correction.displacement, rig_.blendshapes[3].correction.displacement);
  ASSERT_EQ(back.combinations.size(), 2U);
  EXPECT_TRUE(back.combinations[0].drivers[1].halfway);
  EXPECT_EQ(back.combinations[1].rule, Combination::Rule::excess);
  ASSERT_EQ(back.part_motions.size(), 1U);
  EXPECT_EQ(back.part_motions[0].turns[0].translation, (P{0, 0, 1}));
  EXPECT_EQ(back.contacts.balls[0].distance, rig_.contacts.balls[0].distance);
  EXPECT_EQ(back.contacts.balls[0].outer, rig_.contacts.balls[0].outer);
  EXPECT_EQ(back.contacts.balls[0].hold, rig_.contacts.balls[0].hold);
  EXPECT_EQ(back.contacts.folds.triangle, rig_.contacts.folds.triangle);
  EXPECT_EQ(back.contacts.folds.watched, 1U);
  EXPECT_EQ(back.contacts.folds.normal, rig_.contacts.folds.normal);
  EXPECT_EQ(back.contacts.folds.copies, rig_.contacts.folds.copies);
  EXPECT_EQ(back.contacts.riders[0].anchor, rig_.contacts.riders[0].anchor);
  EXPECT_EQ(encodeRig(back), bytes);
}

TEST_F(PoseData, WhatDoesNotFitTheMeshIsRefusedWhenRead) {
  const auto refused = [&](auto damage, const char* what) {
    Rig rig = rig_;
    damage(rig);
    EXPECT_THROW(checkPoseData(rig), std::invalid_argument) << what;
    EXPECT_THROW(decodeRig(encodeRig(rig), "t.rig"), InputError) << what;
  };
  const auto far = static_cast<std::uint32_t>(rig_.neutral.vertexCount());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  refused([&](Rig& r) { r.blendshapes[0].correction = {{far}, {{0, 0, 0}}}; }, "vertex out of range");
  refused([&](Rig& r) { r.blendshapes[0].correction = {{2, 1}, {{0, 0, 0}, {0, 0, 0}}}; }, "vertices out of order");
  refused([&](Rig& r) { r.blendshapes[0].correction = {{2}, {{0, nan, 0}}}; }, "not finite");
  refused([&](Rig& r) { r.combinations = {{"x", Combination::Rule::product, {}, {}}}; }, "no drivers");
  refused([&](Rig& r) { r.combinations = {{"x", Combination::Rule::product, {{9999, false}}, {}}}; }, "no such shape");
  refused(
      [&](Rig& r) {
        r.combinations = {{"x", Combination::Rule::excess, {{0, false}}, {}}};
      },
      "excess over nothing");
  refused(
      [&](Rig& r) {
        r.part_motions = {{RigidPart::Follows::jaw, {}, {0}, {1}, {{9999, {}, {}}}}};
      },
      "turn of no shape");
  refused([&](Rig& r) { r.part_motions = {{RigidPart::Follows::jaw, {}, {0}, {}, {}}}; }, "share missing");
  refused([&](Rig& r) { r.contacts.balls = {{{0, 0, 0}, 0, {}, {}, {}, {}}}; }, "ball without radius");
  refused([&](Rig& r) { r.contacts.balls = {{{0, 0, 0}, 1, {far}, {1}, {}, {}}}; }, "ball's vertex out of range");
  refused([&](Rig& r) { r.contacts.riders = {{0, {0, 0, far}, {1, 0, 0}, -1}}; }, "anchor out of range");
  refused([&](Rig& r) { r.contacts.riders = {{0, {0, 0, 0}, {1, 0, 0}, 5}}; }, "rider's ball");
  refused([&](Rig& r) { r.contacts.balls = {{{0, 0, 0}, 1, {0}, {1}, {1}, {2}}}; }, "held by more than all");
  refused([&](Rig& r) { r.contacts.balls = {{{0, 0, 0}, 1, {0}, {1}, {1}, {}}}; }, "hold without outer");
  refused([&](Rig& r) { r.contacts.folds = {{{0, 1, far}}, 1, {{0, 0, 1}}, {1}, {}}; }, "guarded triangle out of range");
  refused([&](Rig& r) { r.contacts.folds = {{{0, 1, 2}}, 2, {{0, 0, 1}}, {1}, {}}; }, "more watched than there are");
  refused([&](Rig& r) { r.contacts.folds = {{{0, 1, 2}}, 1, {{0, nan, 1}}, {1}, {}}; }, "guard's normal not finite");
  refused([&](Rig& r) { r.contacts.folds = {{{0, 1, 2}}, 1, {{0, 0, 1}}, {0}, {}}; }, "guard without an area");
  Contacts slit = Eye().contacts;
  slit.balls.clear();
  slit.riders.clear();
  refused([&](Rig& r) { r.contacts = slit; }, "slit's ball");
  slit.slits[0].ball = -1;
  slit.slits[0].column[0] = 3;
  refused([&](Rig& r) { r.contacts = slit; }, "column out of range");
  slit.slits[0].column[0] = 1;
  slit.slits[0].upper.pop_back();
  refused([&](Rig& r) { r.contacts = slit; }, "columns that do not fit");
}

}  // namespace
}  // namespace volto::rig
