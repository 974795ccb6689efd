#include "tracker/head_pose.h"

#include <cmath>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace volto::tracker {
namespace {

TEST(HeadPoseSigns, PositiveYawTurnsTheFaceToTheSubjectsLeft) {
  EXPECT_GT((headRotation({0.3, 0, 0}) * Eigen::Vector3d::UnitZ()).x(), 0.2);
}

TEST(HeadPoseSigns, PositivePitchTurnsTheFaceDown) {
  EXPECT_LT((headRotation({0, 0.3, 0}) * Eigen::Vector3d::UnitZ()).y(), -0.2);
}

TEST(HeadPoseSigns, PositiveRollRaisesTheLeftEar) {
  EXPECT_GT((headRotation({0, 0, 0.3}) * Eigen::Vector3d::UnitX()).y(), 0.2);
}

TEST(HeadPoseSigns, AnglesComeBackFromTheRotation) {
  for (const double yaw : {-2.5, -0.4, 0.0, 1.2})
    for (const double pitch : {-1.2, 0.0, 0.7})
      for (const double roll : {-2.0, 0.1, 3.0}) {
        const HeadAngles back = headAngles(headRotation({yaw, pitch, roll}));
        EXPECT_NEAR(back.yaw_rad, yaw, 1e-9);
        EXPECT_NEAR(back.pitch_rad, pitch, 1e-9);
        EXPECT_NEAR(back.roll_rad, roll, 1e-9);
      }
}

TEST(HeadPoseSigns, LookingStraightDownStillGivesTheRotation) {
  const HeadAngles straight_down{0.4, std::acos(0.0), 0};
  const Eigen::Matrix3d rotation = headRotation(straight_down);
  EXPECT_TRUE(headRotation(headAngles(rotation)).isApprox(rotation, 1e-6));
}

TEST(HeadPoseSigns, AHeadThatLooksStraightInIsTheIdentity) {
  HeadPose pose;
  setHeadPose(Eigen::Matrix3d::Identity(), {1, 2, 3}, pose);
  EXPECT_EQ(pose.rotation, (std::array<float, 4>{0, 0, 0, 1}));
  EXPECT_EQ(pose.translation_mm, (std::array<float, 3>{1, 2, 3}));
  EXPECT_TRUE(pose.observed);
}

}  // namespace
}  // namespace volto::tracker
