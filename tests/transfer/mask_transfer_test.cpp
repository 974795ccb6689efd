#include "transfer/mask_transfer.h"

#include <numbers>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "rig/build_rig.h"
#include "tests/rig/test_head.h"

namespace volto::transfer {
namespace {

rig::Rig rigOf(const test::TestHead& head, int levels) {
  rig::RigOptions options;
  options.name = "head";
  options.subdivision.levels = levels;
  return rig::buildRig(head.mesh, head.points, options);
}

// Something that every part of a face does a little of.
rig::VertexPositions moved(const rig::VertexPositions& at, double amount) {
  rig::VertexPositions out = at;
  const double size = (at.colwise().maxCoeff() - at.colwise().minCoeff()).maxCoeff();
  for (Eigen::Index v = 0; v < at.rows(); ++v) {
    const double x = at(v, 0) / size, y = at(v, 1) / size;
    out.row(v) += amount * size * Eigen::RowVector3d(0.2 * y, std::cos(2 * x), 0.5 * x * y);
  }
  return out;
}

TEST(MaskPlaces, SplitAtTheCentroidWhateverVertexWasNearest) {
  const rig::Rig rig = rigOf(test::makeTestHead({.subdivisions = 4}), 2);
  const std::vector<MaskPlace> places = placesOf(rig.refined);
  ASSERT_GT(places.size(), kFeaturePointCount + rig::kMaskTriangleCount / 2);
  std::size_t centroids = 0;
  for (std::size_t p = 0; p < places.size(); ++p) {
    double sum = 0, least = 1;
    for (const double b : places[p].barycentric) {
      sum += b;
      least = std::min(least, b);
    }
    EXPECT_NEAR(sum, 1, 1e-12) << p;
    EXPECT_EQ(least > 0, p >= kFeaturePointCount) << p;  // only what was added lies inside
    centroids += std::abs(least - 1.0 / 3) < 1e-12 ? 1U : 0U;
  }
  // Once per triangle that was split at all.
  std::vector<bool> split(rig::kMaskTriangleCount, false);
  for (std::size_t p = kFeaturePointCount; p < places.size(); ++p) split[places[p].triangle] = true;
  EXPECT_EQ(centroids, static_cast<std::size_t>(std::count(split.begin(), split.end(), true)));
}

TEST(MaskPlaces, InterpolationIsLinearInEveryTriangle) {
  const rig::Rig rig = rigOf(test::makeTestHead({.subdivisions = 4}), 2);
  const std::vector<MaskPlace> places = placesOf(rig.refined);
  const MaskInterpolation interpolation(rig.refined);
  // A value that is linear in the coordinates of each triangle, read at a place between the points.
  for (std::uint8_t t = 0; t < rig::kMaskTriangleCount; ++t) {
    const MaskPlace asked{t, {0.5, 0.2, 0.3}};
    const MaskInterpolation::Row row = interpolation.at(asked);
    std::array<double, 3> reached{};
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint16_t p = row.point[i];
      for (std::size_t c = 0; c < 3; ++c) {
        const double at = p < kFeaturePointCount ? (rig::maskTriangles()[t][c] == p ? 1.0 : 0.0) : places[p].barycentric[c];
        reached[c] += row.weight[i] * at;
      }
      EXPECT_GE(row.weight[i], -1e-9);
    }
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(reached[c], asked.barycentric[c], 1e-9) << int{t};
  }
}

TEST(MaskTransfer, SourceAtRestLeavesTargetAtRest) {
  const rig::Rig source = rigOf(test::makeTestHead({.subdivisions = 3}), 1), target = rigOf(test::makeTestHead(), 0);
  EXPECT_EQ(MaskTransfer(source, target).transfer(source.neutral.positions), target.neutral.positions);
}

TEST(MaskTransfer, TurnedAndEnlargedHeadDoesTheSameTurnedAndEnlarged) {
  const test::TestHead head = test::makeTestHead({.subdivisions = 3});
  test::TestHead other = head;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, -2, 3).normalized()).toRotationMatrix();
  const auto carried = [&](const rig::VertexPositions& p) {
    return rig::VertexPositions((2.5 * p * turn.transpose()).rowwise() + Eigen::RowVector3d(10, 20, -30));
  };
  other.mesh.positions = carried(head.mesh.positions);
  const rig::Rig source = rigOf(head, 1), target = rigOf(other, 1);
  const rig::VertexPositions example = moved(source.neutral.positions, 0.05);
  const rig::VertexPositions own = MaskTransfer(source, source).transfer(example);
  const rig::VertexPositions there = MaskTransfer(source, target).transfer(example);
  const double size = (own.colwise().maxCoeff() - own.colwise().minCoeff()).norm();
  EXPECT_LT((there - carried(own)).rowwise().norm().maxCoeff(), 1e-4 * size);
  EXPECT_GT((own - source.neutral.positions).rowwise().norm().maxCoeff(), 0.01 * size);
}

// A unit is a distance between two or three points, which are never quite where they should be.
TEST(MaskTransfer, MouthThatIsHardlyWiderIsTheSameMouthAndOneTwiceAsWideIsNot) {
  const rig::Rig source = rigOf(test::makeTestHead(), 0);
  const MaskPlace corner = placesOf(drivingMask(source))[rig::featurePointIndex("8.3").value()];
  const auto sideways = [&](double wider) {
    rig::Rig target = source;
    target.fapu.fapu.mouth_width *= wider;
    return fapuRatio(source, target, corner).x();
  };
  EXPECT_EQ(sideways(1), 1);
  EXPECT_NEAR(sideways(1.02), 1, 0.004);
  EXPECT_NEAR(sideways(1 / 1.02), 1, 0.004);
  EXPECT_NEAR(sideways(2), 2, 0.02);
  EXPECT_NEAR(sideways(0.5), 0.5, 0.005);
  EXPECT_LT(sideways(1.1), sideways(1.2));
}

// The same surface with other triangles, subdivided otherwise: vertices that are in both meshes go to the same place.
TEST(MaskTransfer, MeshesAndMasksOfAnotherFinenessAgree) {
  const rig::Rig fine = rigOf(test::makeTestHead({.subdivisions = 4}), 2), coarse = rigOf(test::makeTestHead({.subdivisions = 3}), 1);
  EXPECT_FALSE(rig::sameTopology(fine.neutral, coarse.neutral));
  const rig::VertexPositions example = moved(fine.neutral.positions, 0.05);
  const rig::VertexPositions there = MaskTransfer(fine, coarse).transfer(example);
  const rig::VertexPositions wanted = moved(coarse.neutral.positions, 0.05);
  const double furthest = (wanted - coarse.neutral.positions).rowwise().norm().maxCoeff();
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    const auto v = coarse.feature_vertex[p];
    ASSERT_GE(v, 0);
    EXPECT_LT((there.row(v) - wanted.row(v)).norm(), 0.03 * furthest) << p;
  }
}

}  // namespace
}  // namespace volto::transfer
