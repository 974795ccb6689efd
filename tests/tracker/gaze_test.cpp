// Eyes that turn, projected by an equation of the test's own.
#include "tracker/gaze.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tracker/head_pose.h"

namespace volto::tracker {
namespace {

constexpr double kFocal_px = 640;

// A head 600 mm away; its right eye's corners 31 mm apart, its pupil where an eyeball of a centre 7 mm behind them and
// 10.5 mm radius puts it.
struct Scene {
  HeadAngles head;
  double yaw = 0, pitch = 0;  // of the eyes

  std::array<float, 2> project(const Eigen::Vector3d& in_head) const {
    const Eigen::Vector3d p = headRotation(head) * in_head + Eigen::Vector3d(0, 0, -600);
    return {static_cast<float>(320 + kFocal_px * p.x() / -p.z()), static_cast<float>(240 - kFocal_px * p.y() / -p.z())};
  }
  std::array<float, 2> pupil(double middle_x) const {
    const Eigen::Vector3d look(std::sin(yaw) * std::cos(pitch), std::sin(pitch), std::cos(yaw) * std::cos(pitch));
    return project(Eigen::Vector3d(middle_x, 30, -7) + 10.5 * look);
  }
  LandmarkFrame frame() const {
    LandmarkFrame out;
    out.face_present = true;
    out.points_px.assign(68, {320, 240});
    out.points_px[36] = project({-47.5, 30, 0}), out.points_px[39] = project({-16.5, 30, 0});
    out.points_px[45] = project({47.5, 30, 0}), out.points_px[42] = project({16.5, 30, 0});
    const auto right = pupil(-32), left = pupil(32);
    out.pupils[0] = {right[0], right[1], 1};
    out.pupils[1] = {left[0], left[1], 1};
    return out;
  }
  ViewPose pose() const {
    ViewPose out;
    out.rotation = headRotation(head);
    out.translation = {0, 0, -600};
    return out;
  }
};

TEST(Gaze, OneEyesDirectionIsFoundWhateverTheHeadDoes) {
  for (const HeadAngles head :
       {HeadAngles{}, HeadAngles{0.35, 0, 0}, HeadAngles{0, -0.3, 0.2}, HeadAngles{-0.3, 0.2, 0}}) {
    for (const double yaw : {-0.4, 0.0, 0.3}) {
      for (const double pitch : {-0.2, 0.0, 0.25}) {
        Scene scene{head, yaw, pitch};
        const LandmarkFrame frame = scene.frame();
        Gaze::Eye eye;
        ASSERT_TRUE(gazeOfEye({frame.pupils[0].x_px, frame.pupils[0].y_px}, frame.points_px[36], frame.points_px[39],
                              headRotation(head), kFocal_px / 600, eye));
        EXPECT_NEAR(eye.yaw_rad, yaw, 0.05) << "head yaw " << head.yaw_rad;
        EXPECT_NEAR(eye.pitch_rad, pitch, 0.05) << "head pitch " << head.pitch_rad;
      }
    }
  }
}

TEST(Gaze, APupilFurtherOutThanAnEyeTurnsIsHeldAtItsLimit) {
  Gaze::Eye eye;
  if (gazeOfEye({400, 240}, {300, 240}, {320, 240}, Eigen::Matrix3d::Identity(), 1, eye)) {
    EXPECT_LE(std::abs(eye.yaw_rad), 0.76);
  }
  EXPECT_FALSE(gazeOfEye({NAN, 240}, {300, 240}, {320, 240}, Eigen::Matrix3d::Identity(), 1, eye));
}

TEST(GazeTracker, ALookAsideComesThroughAndABlinkKeepsIt) {
  GazeTracker tracker;
  Gaze out;
  for (int i = 0; i < 60; ++i) tracker.push(Scene{}.frame(), Scene{}.pose(), kFocal_px, 1.0 / 30, 1, out);
  EXPECT_NEAR(out.left.yaw_rad, 0, 0.03);
  Scene aside{{}, 0.4, 0};
  for (int i = 0; i < 10; ++i) tracker.push(aside.frame(), aside.pose(), kFocal_px, 1.0 / 30, 1, out);
  EXPECT_NEAR(out.left.yaw_rad, 0.4, 0.06);
  EXPECT_GT(out.confidence, 0.8);
  LandmarkFrame blink = aside.frame();
  blink.pupils = {};
  tracker.push(blink, aside.pose(), kFocal_px, 1.0 / 30, 1, out);
  EXPECT_NEAR(out.left.yaw_rad, 0.4, 0.06);
  EXPECT_LT(out.confidence, 0.5);
  for (int i = 0; i < 30; ++i) tracker.push(blink, aside.pose(), kFocal_px, 1.0 / 30, 1, out);
  EXPECT_EQ(out.confidence, 0);
}

TEST(GazeTracker, ADetectorThatIsOffIsCorrectedOverTime) {
  GazeTracker tracker;
  Gaze out;
  for (int i = 0; i < 900; ++i) {
    LandmarkFrame frame = Scene{}.frame();
    for (Pupil& pupil : frame.pupils) pupil.y_px += 1.5F;
    tracker.push(frame, Scene{}.pose(), kFocal_px, 1.0 / 30, 1, out);
  }
  EXPECT_NEAR(out.left.pitch_rad, 0, 0.04);
}

TEST(Gaze, SidewaysWeightsAreTheSubjectsSides) {
  ArkitWeights weights{};
  ArkitObserved observed;
  Gaze gaze;
  gaze.left.yaw_rad = gaze.right.yaw_rad = 0.3F;  // to the subject's left
  lookSideways(gaze, weights, observed);
  EXPECT_TRUE(observed.none()) << "without confidence nothing is said";
  gaze.confidence = 1;
  lookSideways(gaze, weights, observed);
  EXPECT_NEAR(weights[*arkitBlendshapeIndex("eyeLookOutLeft")], 0.5, 0.01);
  EXPECT_NEAR(weights[*arkitBlendshapeIndex("eyeLookInRight")], 0.5, 0.01);
  EXPECT_EQ(weights[*arkitBlendshapeIndex("eyeLookInLeft")], 0);
  EXPECT_EQ(observed.count(), 4U);
}

}  // namespace
}  // namespace volto::tracker
