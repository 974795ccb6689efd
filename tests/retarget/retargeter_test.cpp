#include "retarget/retargeter.h"

#include <cmath>
#include <cstring>
#include <limits>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "retarget/eyes.h"
#include "tests/retarget/allocation_counter.h"
#include "tests/retarget/synthetic_rig.h"

namespace volto::retarget {
namespace {

using test::deformReference;
using test::syntheticExpression;
using test::syntheticRig;

MaskFrame tracked(const MaskDisplacements& displacement) {
  MaskFrame frame;
  frame.state = TrackingState::tracking;
  frame.confidence = 0.9F;
  frame.t_capture_ns = 123456789;
  frame.capture_seq = 42;
  frame.displacement_fapu = displacement;
  frame.point_confidence.fill(1.0F);
  return frame;
}

AvatarFrame retargeted(const rig::Rig& rig, const MaskFrame& in) {
  AvatarFrame out;
  Retargeter(rig).push(in, out);
  return out;
}

Eigen::Vector3d vertexOf(const AvatarFrame& frame, std::size_t v) {
  return {frame.vertices[v][0], frame.vertices[v][1], frame.vertices[v][2]};
}

TEST(Retargeter, MeshIsNeutralPlusOperatorTimesMask) {
  const rig::Rig rig = syntheticRig();
  const MaskDisplacements displacement = syntheticExpression(1, 0.3F);
  const AvatarFrame out = retargeted(rig, tracked(displacement));
  const rig::VertexPositions expected = deformReference(rig, displacement);
  ASSERT_EQ(out.vertices.size(), rig.neutral.vertexCount());
  for (std::size_t v = 0; v < out.vertices.size(); ++v) {
    const double error = (vertexOf(out, v) - expected.row(static_cast<Eigen::Index>(v)).transpose()).norm();
    ASSERT_LT(error, 1e-4 * rig.fapu.fapu.eye_separation) << v;
  }
}

TEST(Retargeter, NeutralIsNeutralToTheBitWhateverTheBufferHeld) {
  const rig::Rig rig = syntheticRig();
  Retargeter retargeter(rig);
  AvatarFrame out;
  out.vertices.assign(rig.neutral.vertexCount(), {7, 7, 7});
  retargeter.push(tracked(syntheticExpression(2)), out);
  retargeter.push(tracked({}), out);
  for (std::size_t v = 0; v < out.vertices.size(); ++v) {
    const Eigen::RowVector3f neutral = rig.neutral.positions.row(static_cast<Eigen::Index>(v)).cast<float>();
    ASSERT_EQ(std::memcmp(out.vertices[v].data(), neutral.data(), sizeof(out.vertices[v])), 0) << v;
  }
  for (const float w : out.weights) EXPECT_EQ(w, 0.0F);
}

// The same mask on a face ten times as large and turned on its side: ten times the motion, turned.
TEST(Retargeter, FapuCarriesAnExpressionToAFaceOfAnotherSizeAndFrame) {
  const rig::Rig small = syntheticRig();
  rig::Rig large = syntheticRig({.size = 10.0});
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.2, 1.0, -0.4).normalized()).toRotationMatrix();
  large.mesh_from_head = turn;
  const MaskFrame frame = tracked(syntheticExpression(3, 0.2F));
  const AvatarFrame a = retargeted(small, frame), b = retargeted(large, frame);
  double most = 0.0;
  for (std::size_t v = 0; v < a.vertices.size(); ++v) {
    const auto row = static_cast<Eigen::Index>(v);
    const Eigen::Vector3d move_a = vertexOf(a, v) - small.neutral.positions.row(row).transpose();
    const Eigen::Vector3d move_b = vertexOf(b, v) - large.neutral.positions.row(row).transpose();
    ASSERT_LT((10.0 * (turn * move_a) - move_b).norm(), 1e-4) << v;
    most = std::max(most, move_a.norm());
  }
  EXPECT_GT(most, 0.05);
}

// A face with a mouth twice as wide and nothing else different: mouth points move twice as far sideways, other points
// as before.
TEST(Retargeter, EachAxisIsMeasuredInItsOwnUnit) {
  const rig::Rig narrow = syntheticRig();
  rig::Rig wide = narrow;
  wide.fapu.fapu.mouth_width *= 2.0;
  const std::size_t mouth_corner = *rig::featurePointIndex("8.3"), brow = *rig::featurePointIndex("4.1");
  for (rig::Rig* rig : {const_cast<rig::Rig*>(&narrow), &wide}) {
    // Vertex 0 follows the mouth corner alone, vertex 1 the brow.
    rig->deformation = {};
    rig->deformation.row_start = {0, 1, 2};
    rig->deformation.row_start.resize(rig->neutral.vertexCount() + 1, 2);
    rig->deformation.point = {static_cast<std::uint8_t>(mouth_corner), static_cast<std::uint8_t>(brow)};
    rig->deformation.weight = {1.0F, 1.0F};
  }
  MaskDisplacements displacement{};
  displacement[mouth_corner] = {0.1F, 0.1F, 0.1F};
  displacement[brow] = {0.1F, 0.1F, 0.1F};
  const AvatarFrame a = retargeted(narrow, tracked(displacement)), b = retargeted(wide, tracked(displacement));
  const auto move = [&](const AvatarFrame& frame, Eigen::Index v) -> Eigen::Vector3d {
    return vertexOf(frame, static_cast<std::size_t>(v)) - narrow.neutral.positions.row(v).transpose();
  };
  EXPECT_NEAR(move(a, 0).x(), 0.1 * 0.5, 1e-6);   // mouth width
  EXPECT_NEAR(move(a, 0).y(), 0.1 * 0.2, 1e-6);   // mouth to nose
  EXPECT_NEAR(move(a, 1).x(), 0.1 * 0.6, 1e-6);   // eye separation
  EXPECT_NEAR(move(a, 1).y(), 0.1 * 0.45, 1e-6);  // eye to nose
  EXPECT_NEAR(move(b, 0).x(), 0.1 * 1.0, 1e-6);
  EXPECT_NEAR((move(a, 1) - move(b, 1)).norm(), 0.0, 1e-6);
}

TEST(Retargeter, LookingLeftTurnsBothEyesToTheSubjectsLeftAndUpIsUp) {
  rig::Rig rig = syntheticRig();
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(-1.3, Eigen::Vector3d(0.3, 0.5, 1.0).normalized()).toRotationMatrix();
  for (const bool turned : {false, true}) {
    if (turned) rig.mesh_from_head = turn;
    for (const rig::RigidPart& part : rig.rigid_parts) {
      const Eigen::Vector3d centre(part.centre[0], part.centre[1], part.centre[2]);
      MaskFrame frame = tracked({});
      frame.gaze.confidence = 1.0F;
      frame.gaze.left = {0.4F, 0.0F};
      frame.gaze.right = {0.4F, 0.0F};
      const AvatarFrame left = retargeted(rig, frame);
      frame.gaze.left = {0.0F, 0.3F};
      frame.gaze.right = {0.0F, 0.3F};
      const AvatarFrame up = retargeted(rig, frame);
      for (const std::uint32_t v : part.vertices) {
        const auto row = static_cast<Eigen::Index>(v);
        const Eigen::Vector3d arm =
            rig.mesh_from_head.transpose() * (rig.neutral.positions.row(row).transpose() - centre);
        const Eigen::Vector3d arm_left = rig.mesh_from_head.transpose() * (vertexOf(left, v) - centre);
        const Eigen::Vector3d arm_up = rig.mesh_from_head.transpose() * (vertexOf(up, v) - centre);
        EXPECT_NEAR(arm_left.norm(), arm.norm(), 1e-6) << "not rigid";
        // Looking straight ahead (0, 0, 1) becomes (sin, 0, cos): x grows with z.
        EXPECT_NEAR(arm_left.x(), std::cos(0.4) * arm.x() + std::sin(0.4) * arm.z(), 1e-6);
        EXPECT_NEAR(arm_left.y(), arm.y(), 1e-6);
        EXPECT_NEAR(arm_up.y(), std::cos(0.3) * arm.y() + std::sin(0.3) * arm.z(), 1e-6);
        EXPECT_NEAR(arm_up.x(), arm.x(), 1e-6);
      }
    }
  }
}

TEST(Retargeter, EachEyeFollowsItsOwnGazeAndAnUnseenGazeIsStraightAhead) {
  const rig::Rig rig = syntheticRig();
  MaskFrame frame = tracked({});
  frame.gaze.left = {0.5F, 0.1F};
  const AvatarFrame unseen = retargeted(rig, frame);
  frame.gaze.confidence = 0.5F;
  const AvatarFrame seen = retargeted(rig, frame);
  for (const rig::RigidPart& part : rig.rigid_parts) {
    for (const std::uint32_t v : part.vertices) {
      const Eigen::RowVector3f neutral = rig.neutral.positions.row(static_cast<Eigen::Index>(v)).cast<float>();
      EXPECT_EQ(std::memcmp(unseen.vertices[v].data(), neutral.data(), sizeof(Vertex)), 0);
      const bool moved = std::memcmp(seen.vertices[v].data(), neutral.data(), sizeof(Vertex)) != 0;
      EXPECT_EQ(moved, part.follows == rig::RigidPart::Follows::left_eye);
    }
  }
}

TEST(Retargeter, DirectionOfGazeIsTheOneDocumented) {
  const auto rotation = headFromEye({0.3F, 0.2F});
  EXPECT_NEAR(rotation[0][2], std::sin(0.3) * std::cos(0.2), 1e-7);
  EXPECT_NEAR(rotation[1][2], std::sin(0.2), 1e-7);
  EXPECT_NEAR(rotation[2][2], std::cos(0.3) * std::cos(0.2), 1e-7);
}

TEST(Retargeter, HeaderOfTheFrameIsCarriedThrough) {
  MaskFrame in = tracked(syntheticExpression(1));
  in.state = TrackingState::easing;
  in.head.yaw_rad = 0.25F;
  in.gaze.left.yaw_rad = 0.125F;
  const AvatarFrame out = retargeted(syntheticRig({.skin_side = 4}), in);
  EXPECT_EQ(out.t_capture_ns, 123456789);
  EXPECT_EQ(out.capture_seq, 42U);
  EXPECT_EQ(out.state, TrackingState::easing);
  EXPECT_EQ(out.confidence, 0.9F);
  EXPECT_EQ(out.head.yaw_rad, 0.25F);
  EXPECT_EQ(out.gaze.left.yaw_rad, 0.125F);
}

TEST(Retargeter, OnlyWhatIsAskedForIsComputed) {
  const rig::Rig rig = syntheticRig({.skin_side = 4});
  AvatarFrame out;
  Retargeter(rig, {.mesh = false}).push(tracked(syntheticExpression(1)), out);
  EXPECT_TRUE(out.vertices.empty());
  EXPECT_EQ(out.weights.size(), 52U);
  EXPECT_EQ(out.observed.size(), 52U);
  Retargeter(rig, {.weights = false}).push(tracked(syntheticExpression(1)), out);
  EXPECT_EQ(out.vertices.size(), rig.neutral.vertexCount());
  EXPECT_TRUE(out.weights.empty());
  EXPECT_TRUE(out.observed.empty());
}

TEST(Retargeter, NothingIsAllocatedPerFrame) {
  Retargeter retargeter(syntheticRig());
  AvatarFrame out;
  std::vector<MaskFrame> frames;
  for (std::uint32_t i = 0; i < 50; ++i) {
    frames.push_back(tracked(syntheticExpression(i, 0.2F)));
    frames.back().point_confidence[i] = 0.3F;  // the fit is set up anew
    frames.back().gaze.confidence = 1.0F;
    frames.back().gaze.left.yaw_rad = 0.01F * static_cast<float>(i);
  }
  retargeter.push(frames[0], out);
  const std::size_t before = test::allocationCount();
  for (const MaskFrame& frame : frames) retargeter.push(frame, out);
  EXPECT_EQ(test::allocationCount(), before);
  const std::vector<int> proof(10);
  EXPECT_GT(test::allocationCount(), before) << "the counter does not count";
}

TEST(Retargeter, SameFramesGiveTheSameBits) {
  const rig::Rig rig = syntheticRig();
  Retargeter one(rig), two(rig);
  AvatarFrame a, b;
  for (std::uint32_t i = 0; i < 20; ++i) {
    const MaskFrame frame = tracked(syntheticExpression(i, 0.2F));
    one.push(frame, a);
    two.push(frame, b);
    ASSERT_EQ(a.weights, b.weights);
    ASSERT_EQ(std::memcmp(a.vertices.data(), b.vertices.data(), a.vertices.size() * sizeof(Vertex)), 0);
  }
  one.reset();
  Retargeter fresh(rig);
  one.push(tracked(syntheticExpression(5, 0.2F)), a);
  fresh.push(tracked(syntheticExpression(5, 0.2F)), b);
  EXPECT_EQ(a.weights, b.weights) << "reset() did not forget";
}

TEST(Retargeter, DamagedFramesGiveFiniteOutput) {
  const rig::Rig rig = syntheticRig();
  Retargeter retargeter(rig);
  AvatarFrame out;
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -3e38F}) {
    MaskFrame frame = tracked(syntheticExpression(1));
    for (std::size_t p = 0; p < kFeaturePointCount; p += 7) frame.displacement_fapu[p].fill(bad);
    frame.point_confidence.fill(bad);
    frame.gaze.confidence = 1.0F;
    frame.gaze.left = {bad, bad};
    frame.arkit_observed.set();
    frame.arkit_weights.fill(bad);
    retargeter.push(frame, out);
    for (const Vertex& v : out.vertices) ASSERT_TRUE(std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]));
    for (const float w : out.weights) ASSERT_TRUE(w >= 0.0F && w <= 1.0F);
  }
}

}  // namespace
}  // namespace volto::retarget
