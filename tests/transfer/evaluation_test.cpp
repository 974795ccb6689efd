#include "transfer/evaluation.h"

#include <gtest/gtest.h>

#include "tests/transfer/sheet.h"

namespace volto::transfer {
namespace {

struct OneExpression : ::testing::Test {
  Sheet sheet = makeSheet(6, 4, 0.4);
  const rig::Mesh& mesh = sheet.mesh;
  rig::VertexPositions truth = mesh.positions;
  const std::vector<std::string> names{"lift"};

  OneExpression() { truth.col(2).array() += 2.0; }

  Evaluation judge(const rig::VertexPositions& result, const EvaluationScope& scope = {}) const {
    return evaluate(mesh, mesh.positions, names, std::vector{result}, std::vector{truth}, scope);
  }
};

TEST_F(OneExpression, PerfectResultHasNoError) {
  const Evaluation e = judge(truth);
  EXPECT_DOUBLE_EQ(e.mean_relative, 0);
  EXPECT_EQ(e.expressions[0].flipped, 0U);
  EXPECT_EQ(e.expressions[0].area_distorted, 0U);
}

TEST_F(OneExpression, DoingNothingIsAnErrorOfOne) {
  const Evaluation e = judge(mesh.positions);
  EXPECT_DOUBLE_EQ(e.mean_relative, 1);
  EXPECT_DOUBLE_EQ(e.expressions[0].whole.rms, 2);
  EXPECT_DOUBLE_EQ(e.expressions[0].whole.maximum, 2);
}

TEST_F(OneExpression, HalfWayIsAnErrorOfAHalf) {
  EXPECT_DOUBLE_EQ(judge((mesh.positions + truth) / 2).mean_relative, 0.5);
}

TEST_F(OneExpression, OnlyVerticesInScopeAreJudged) {
  rig::VertexPositions result = truth;
  result.row(result.rows() - 1).array() += 50;
  EvaluationScope scope;
  scope.end_vertex = mesh.vertexCount() - 1;
  EXPECT_DOUBLE_EQ(judge(result, scope).mean_relative, 0);
  EXPECT_EQ(judge(result, scope).expressions[0].whole.vertices, mesh.vertexCount() - 1);
  EXPECT_GT(judge(result).mean_relative, 1);
}

TEST_F(OneExpression, ErrorIsFoundInItsRegion) {
  EvaluationScope scope;
  scope.region_names = {"lower", "upper"};
  for (Eigen::Index v = 0; v < mesh.positions.rows(); ++v)
    scope.region_of_vertex.push_back(mesh.positions(v, 1) < 2 ? 0 : 1);
  rig::VertexPositions result = truth;
  for (Eigen::Index v = 0; v < result.rows(); ++v)
    if (scope.region_of_vertex[static_cast<std::size_t>(v)] == 1) result.row(v) = mesh.positions.row(v);
  const ExpressionEvaluation& e = judge(result, scope).expressions[0];
  EXPECT_DOUBLE_EQ(*e.regions[0].relative, 0);
  EXPECT_DOUBLE_EQ(*e.regions[1].relative, 1);
}

TEST_F(OneExpression, TriangleInsideOutIsCounted) {
  rig::VertexPositions result = truth;
  result.col(0) *= -1;  // seen from behind
  EXPECT_EQ(judge(result).expressions[0].flipped, 2 * mesh.polygonCount());
}

TEST_F(OneExpression, ExpressionThatDoesNotMoveHasNoRelativeError) {
  const Evaluation e = evaluate(mesh, mesh.positions, names, std::vector{truth}, std::vector{mesh.positions});
  EXPECT_FALSE(e.expressions[0].whole.relative.has_value());
  EXPECT_EQ(e.related, 0U);
  EXPECT_DOUBLE_EQ(e.mean_relative, 0);
}

// An expression of somebody else counts by what it does, not by how its owner looks.
TEST_F(OneExpression, AnotherPersonsTruthIsCarriedOverAsDisplacement) {
  const rig::VertexPositions other = mesh.positions * 1.5;
  rig::VertexPositions others_expression = other;
  others_expression.col(2).array() += 2.0;
  const Evaluation e = evaluate(mesh, other, names, std::vector{truth}, std::vector{others_expression});
  EXPECT_LT(e.mean_relative, 1e-12);
}

// The sheet's slit as a mouth.
rig::Contacts mouthOf(const Sheet& sheet) {
  rig::Contacts contacts;
  rig::SlitContact slit;
  slit.up = {0, 1, 0};
  for (std::size_t k = 0; k < sheet.upper.size(); ++k) {
    slit.upper.push_back({sheet.upper[k], sheet.upper[k], 0});
    slit.lower.push_back({sheet.lower[k], sheet.lower[k], 0});
    slit.least_gap.push_back(0);
  }
  // A corner on each side, so that there are columns.
  slit.upper.push_back({sheet.upper.back() + 1, sheet.upper.back() + 1, 0});
  slit.lower.push_back({sheet.upper.back() + 1, sheet.upper.back() + 1, 0});
  slit.least_gap.push_back(0);
  contacts.slits.push_back(slit);
  return contacts;
}

TEST_F(OneExpression, LipsThatPassEachOtherAreMeasured) {
  const rig::Contacts contacts = mouthOf(sheet);
  EvaluationScope scope;
  EXPECT_FALSE(judge(truth).expressions[0].result_passes);
  scope.contacts = &contacts;
  EXPECT_EQ(judge(truth, scope).expressions[0].result_passes->lips, 0);
  rig::VertexPositions crossed = truth;
  for (const std::uint32_t v : sheet.upper) crossed(v, 1) -= 0.7;  // the slit is 0.4 wide
  EXPECT_NEAR(judge(crossed, scope).expressions[0].result_passes->lips, 0.3, 1e-5);
  EXPECT_EQ(judge(crossed, scope).expressions[0].expected_passes->lips, 0);
}

// The upper half stands in front of the lower one and comes down: each of its margin's triangles goes through what is
// there.
TEST(Evaluation, LipsThatGoThroughEachOtherAreCountedInTheirRegions) {
  const Sheet sheet = makeSheet(24, 8, 0.2);
  const rig::VertexPositions& neutral = sheet.mesh.positions;
  EvaluationScope scope;
  const rig::Contacts contacts = mouthOf(sheet);
  scope.contacts = &contacts;
  scope.eye_separation = 4;
  scope.region_names = {"upper lip", "lower lip", "rest"};
  scope.intersecting = {true, true, false};
  for (Eigen::Index v = 0; v < neutral.rows(); ++v)
    scope.region_of_vertex.push_back(std::abs(neutral(v, 1) - 4) > 1.5 ? 2 : neutral(v, 1) > 4 ? 0 : 1);
  scope.skin = rig::triangulate(sheet.mesh);
  rig::VertexPositions through = neutral, open = neutral;
  for (std::size_t k = 0; k < sheet.upper.size(); ++k) {
    through(sheet.upper[k], 1) -= 1.5;
    through(sheet.upper[k], 2) += k % 2 == 0 ? 0.3 : -0.3;
  }
  for (Eigen::Index v = 0; v < open.rows(); ++v)
    if (open(v, 1) < 4) open(v, 1) -= 1.5;
  const auto judge = [&](const std::vector<std::string>& names, const std::vector<rig::VertexPositions>& results) {
    return evaluate(sheet.mesh, neutral, names, results,
                    std::vector<rig::VertexPositions>(results.size(), neutral), scope);
  };
  const ExpressionEvaluation alone = judge({"through"}, {through}).expressions[0];
  EXPECT_GT(alone.result_crossings->pairs, 5U);
  EXPECT_GT(alone.result_crossings->regions[0], 5U);
  EXPECT_EQ(alone.result_crossings->regions[0], alone.result_crossings->pairs);
  EXPECT_GT(alone.result_crossings->regions[1], 5U);
  EXPECT_EQ(alone.expected_crossings->pairs, 0U);
  EXPECT_TRUE(alone.counted_with.empty());
  // Made to be added to a shape that opens as far, it is counted on the sum.
  const Evaluation both = judge({"open", "through"}, {open, through});
  EXPECT_EQ(both.expressions[1].counted_with, "open");
  EXPECT_EQ(both.expressions[1].result_crossings->pairs, 0U);
  EXPECT_GT(both.expressions[1].whole.rms, 0);
  EXPECT_TRUE(both.expressions[0].counted_with.empty());
}

}  // namespace
}  // namespace volto::transfer
