#include "rig/head_frame.h"

#include <numbers>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "rig/control_mask.h"

namespace volto::rig {
namespace {

// The reference face, scaled, turned and moved: as a mesh file of another convention would have it.
FeaturePointPositions faceTurnedBy(const Eigen::Matrix3d& mesh_from_head) {
  return ((referenceMask() * 0.1) * mesh_from_head.transpose()).rowwise() + Eigen::RowVector3d(3, 160, -7);
}

Eigen::Matrix3d about(const Eigen::Vector3d& axis, double degrees) {
  return Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis.normalized()).toRotationMatrix();
}

}  // namespace

TEST(HeadFrame, UprightFaceNeedsNoRotation) {
  EXPECT_EQ(meshFromHead(faceTurnedBy(Eigen::Matrix3d::Identity())), Eigen::Matrix3d::Identity());
}

TEST(HeadFrame, ArtistsUprightIsTrustedOverAPitchOfTheFace) {
  EXPECT_EQ(meshFromHead(faceTurnedBy(about({1, 0, 0}, 12))), Eigen::Matrix3d::Identity());
}

TEST(HeadFrame, ZUpMeshIsRecognisedExactly) {
  Eigen::Matrix3d z_up = Eigen::Matrix3d::Zero();  // x left, -y out of the face, z up
  z_up(0, 0) = 1;
  z_up(2, 1) = 1;
  z_up(1, 2) = -1;
  EXPECT_EQ(meshFromHead(faceTurnedBy(z_up)), z_up);
  EXPECT_EQ(meshFromHead(faceTurnedBy(about({1, 0, 0}, -9) * z_up)), z_up);
}

TEST(HeadFrame, FaceInAnyAttitudeIsFound) {
  const Eigen::Matrix3d attitude = about({1, 2, -0.5}, 71);
  EXPECT_TRUE(meshFromHead(faceTurnedBy(attitude)).isApprox(attitude, 1e-9));
}

TEST(HeadFrame, PointsOnOneLineShowNoFace) {
  EXPECT_THROW(meshFromHead(FeaturePointPositions::Ones()), std::invalid_argument);
  FeaturePointPositions line = FeaturePointPositions::Zero();
  for (Eigen::Index i = 0; i < line.rows(); ++i) line(i, 1) = static_cast<double>(i);
  EXPECT_THROW(meshFromHead(line), std::invalid_argument);
}

}  // namespace volto::rig
