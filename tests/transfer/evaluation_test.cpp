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

}  // namespace
}  // namespace volto::transfer
