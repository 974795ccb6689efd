// The control mask, refined on a head: what dense driving data drives.
#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "rig/build_rig.h"
#include "rig/rig_definition.h"
#include "rig/rig_file.h"
#include "tests/rig/test_head.h"

namespace volto::rig {
namespace {

using test::deform;
using test::makeTestHead;
using test::TestHead;

Rig rigged(const TestHead& head, const Subdivision& subdivision, const std::vector<VertexPositions>& examples = {}) {
  RigOptions options;
  options.subdivision = subdivision;
  options.examples = examples;
  return buildRig(head.mesh, head.points, options);
}

Subdivision levels(int n, std::vector<std::uint8_t> triangles = {}) {
  Subdivision s;
  s.levels = n;
  s.triangles = std::move(triangles);
  return s;
}

// A face that bulges here and there, finer than 84 points can say.
VertexPositions bulges(const Mesh& mesh, double wavelength, double phase) {
  VertexPositions d = VertexPositions::Zero(mesh.positions.rows(), 3);
  for (Eigen::Index v = 0; v < d.rows(); ++v)
    d(v, 2) = std::sin(mesh.positions(v, 0) / wavelength + phase) * std::cos(mesh.positions(v, 1) / wavelength);
  return d;
}

double selfTransferError(const Rig& rig, const VertexPositions& truth, std::size_t vertices) {
  const VertexPositions made =
      displaceVertices(rig.refined, pointDisplacements(rig.refined, rig.neutral.positions, truth));
  const auto n = static_cast<Eigen::Index>(vertices);
  return (made - truth).topRows(n).norm() / truth.topRows(n).norm();
}

class RefinedHead : public testing::Test {
 protected:
  TestHead head_ = makeTestHead({.subdivisions = 3});
  std::size_t on_mask_ = head_.skirt[0][1];  // the skirt's vertices come after the mask's
};

TEST_F(RefinedHead, OnceIs220PointsAndTwiceAbout628) {
  const Rig once = rigged(head_, levels(1)), twice = rigged(head_, levels(2));
  EXPECT_EQ(once.refined.pointCount(), 220U);
  EXPECT_EQ(once.refined.triangles.size(), 408U);
  // A triangle without a vertex well inside stays whole.
  EXPECT_LE(twice.refined.pointCount(), 628U);
  EXPECT_GE(twice.refined.pointCount(), 620U);
  EXPECT_EQ(twice.refined.triangles.size(), 136 + 2 * (twice.refined.pointCount() - 84));
  EXPECT_TRUE(rigged(head_, {}).refined.empty());
}

TEST_F(RefinedHead, NoVertexIsAPointTwiceHoweverOftenItIsSubdivided) {
  const Rig rig = rigged(makeTestHead(), levels(6));
  std::set<std::int32_t> seen(rig.refined.vertex.begin(), rig.refined.vertex.end());
  EXPECT_EQ(seen.size(), rig.refined.pointCount());
  EXPECT_LT(rig.refined.pointCount(), rig.neutral.vertexCount());
}

TEST_F(RefinedHead, PointsFollowTheirDisplacementExactlyAndNeutralStays) {
  const Rig rig = rigged(head_, levels(1));
  VertexPositions d = VertexPositions::Zero(220, 3);
  EXPECT_TRUE((displaceVertices(rig.refined, d).array() == 0.0).all());
  for (Eigen::Index p = 0; p < d.rows(); ++p) d.row(p) << 0.1 * static_cast<double>(p % 7), std::sin(p), std::cos(p);
  const VertexPositions moved = displaceVertices(rig.refined, d);
  for (std::size_t p = 0; p < 220; ++p)
    EXPECT_LT((moved.row(rig.refined.vertex[p]) - d.row(static_cast<Eigen::Index>(p))).norm(), 1e-6) << p;
}

TEST_F(RefinedHead, TheFinerTheMaskTheNearerToTheTruth) {
  const VertexPositions truth = bulges(head_.mesh, 14, 0.4);
  double before = 1;
  for (const int level : {1, 2, 3}) {
    const double error = selfTransferError(rigged(head_, levels(level)), truth, on_mask_);
    EXPECT_LT(error, 0.85 * before) << level;
    before = error;
  }
  EXPECT_LT(before, 0.2);
}

TEST_F(RefinedHead, SparseDataDrivesTheRefinedMaskLikeThePlainOne) {
  const Rig rig = rigged(head_, levels(1));
  const std::size_t smile = arkitBlendshapeIndex("mouthSmileLeft").value(),
                    jaw = arkitBlendshapeIndex("jawOpen").value();
  for (const std::size_t shape : {smile, jaw}) {
    FeaturePointPositions d;
    for (std::size_t p = 0; p < kFeaturePointCount; ++p)
      for (std::size_t axis = 0; axis < 3; ++axis)
        d(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(axis)) =
            rig.blendshapes[shape].mask_displacement[p][axis];
    const VertexPositions points = refineDisplacement(rig.refined, d);
    EXPECT_TRUE(points.topRows(84).isApprox(VertexPositions(d)));
    const VertexPositions refined = displaceVertices(rig.refined, points), plain = deform(rig, d);
    EXPECT_LT((refined - plain).norm(), 0.08 * plain.norm()) << rig.blendshapes[shape].name;
  }
}

TEST_F(RefinedHead, ChosenTrianglesAloneAreSubdivided) {
  const Rig rig = rigged(head_, levels(2, {5, 80}));
  EXPECT_EQ(rig.refined.pointCount(), 84U + 2 * 4);
  for (std::size_t t = 0; t < rig.refined.triangles.size(); ++t)
    for (const std::uint16_t p : rig.refined.triangles[t])
      if (p >= kFeaturePointCount) {
        EXPECT_TRUE(rig.refined.base_triangle[t] == 5 || rig.refined.base_triangle[t] == 80);
      }
}

TEST_F(RefinedHead, UpperLipAndLidsNeverDependOnTheOppositeSide) {
  const Rig rig = rigged(head_, levels(2));
  for (std::size_t p = 0; p < rig.refined.pointCount(); ++p) {
    VertexPositions d = VertexPositions::Zero(static_cast<Eigen::Index>(rig.refined.pointCount()), 3);
    if (p < kFeaturePointCount) continue;
    const bool lower = std::find(head_.lower_mouth.begin(), head_.lower_mouth.end(),
                                 static_cast<std::uint32_t>(rig.refined.vertex[p])) != head_.lower_mouth.end();
    if (!lower) continue;
    d(static_cast<Eigen::Index>(p), 1) = -5;
    const VertexPositions moved = displaceVertices(rig.refined, d);
    for (const std::uint32_t v : head_.upper_mouth) EXPECT_LT(moved.row(v).norm(), 0.05);
  }
}

TEST_F(RefinedHead, TheAutomaticChoiceGoesWhereTheExamplesMove) {
  // Only the left cheek moves in detail.
  std::vector<VertexPositions> examples = {bulges(head_.mesh, 9, 0), bulges(head_.mesh, 9, 1.5)};
  for (VertexPositions& d : examples)
    for (Eigen::Index v = 0; v < d.rows(); ++v)
      if (head_.mesh.positions(v, 0) < 15 || head_.mesh.positions(v, 1) > 0) d.row(v).setZero();
  Subdivision automatic;
  automatic.budget = 40;
  const Rig rig = rigged(head_, automatic, examples);
  ASSERT_EQ(rig.refined.pointCount(), 124U);
  std::size_t there = 0;
  for (std::size_t p = kFeaturePointCount; p < 124; ++p)
    there += rig.refined.positions(static_cast<Eigen::Index>(p), 0) > 5 &&
                     rig.refined.positions(static_cast<Eigen::Index>(p), 1) < 10
                 ? 1U
                 : 0U;
  EXPECT_GT(there, 34U);
  const Rig all = rigged(head_, levels(1));
  EXPECT_LT(selfTransferError(rig, examples[0], on_mask_), selfTransferError(all, examples[0], on_mask_))
      << "40 points in the right place do more than 136 everywhere";
}

TEST_F(RefinedHead, AChoiceThatWasKeptGivesTheSameMask) {
  Subdivision automatic;
  automatic.budget = 12;
  const Rig rig = rigged(head_, automatic, {bulges(head_.mesh, 20, 0)});
  RigOptions options;
  options.subdivision = automatic;
  const RigDefinition kept = parseRigDefinition(formatRigDefinition(definitionOf(rig, options)), "R.json");
  EXPECT_EQ(kept.subdivision.vertices.size(), 12U);
  const Rig again = rigged(head_, kept.subdivision);
  EXPECT_EQ(again.refined.vertex, rig.refined.vertex);
  EXPECT_EQ(again.refined.triangles, rig.refined.triangles);
}

TEST_F(RefinedHead, TravelsInTheRigFile) {
  const Rig rig = rigged(head_, levels(1));
  const auto bytes = encodeRig(rig);
  const Rig read = decodeRig(bytes, "a.rig");
  EXPECT_EQ(read.refined.vertex, rig.refined.vertex);
  EXPECT_EQ(read.refined.positions, rig.refined.positions);
  EXPECT_EQ(read.refined.triangles, rig.refined.triangles);
  EXPECT_EQ(read.refined.to_vertices.weight, rig.refined.to_vertices.weight);
  EXPECT_EQ(read.refined.to_vertices.point, rig.refined.to_vertices.point);
  EXPECT_EQ(read.refined.from_feature_points.start, rig.refined.from_feature_points.start);
  EXPECT_EQ(encodeRig(read), bytes);
}

TEST_F(RefinedHead, WhatCannotBeSubdividedIsNamed) {
  Subdivision wrong;
  wrong.vertices = {999'999};
  try {
    rigged(head_, wrong);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("vertex 999999"), std::string::npos) << e.what();
  }
  wrong.vertices = {std::get<std::uint32_t>(head_.points.at(0))};  // a feature point already
  EXPECT_THROW(rigged(head_, wrong), InputError);
  Subdivision blind;
  blind.budget = 10;
  EXPECT_THROW(rigged(head_, blind), InputError) << "automatic without examples";
}

}  // namespace
}  // namespace volto::rig
