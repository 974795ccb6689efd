#include "transfer/expression_transfer.h"

#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "rig/build_rig.h"
#include "rig/contacts.h"
#include "rig/mesh_io.h"
#include "rig/pose.h"
#include "tests/rig/test_head.h"
#include "tests/support/test_data.h"
#include "transfer/added_examples.h"
#include "transfer/evaluation.h"
#include "transfer/mesh_set.h"
#include "transfer/surface.h"

namespace volto::transfer {
namespace {

rig::Rig annotated(const std::filesystem::path& mesh, const std::string& points) {
  std::ifstream file(test::sourceDir() / "tests/rig" / points);
  std::stringstream text;
  text << file.rdbuf();
  return rig::buildRig(rig::readMesh(mesh), rig::parseFeaturePoints(text.str(), points));
}

TEST(ExpressionTransfer, ExampleOfAnotherSizeIsRefused) {
  const test::TestHead head = test::makeTestHead();
  const rig::Rig rig = rig::buildRig(head.mesh, head.points);
  const ExpressionTransfer transfer(rig, rig, {.method = Method::mask});
  EXPECT_THROW(transfer.transfer(std::vector{rig::VertexPositions(rig::VertexPositions::Zero(3, 3))}), std::invalid_argument);
}

TEST(ExpressionTransfer, ByDeformationAHeadGetsItsOwnExpressionWhole) {
  const test::TestHead head = test::makeTestHead({.subdivisions = 3, .parts = true});
  const rig::Rig rig = rig::buildRig(head.mesh, head.points);
  rig::VertexPositions example = rig.neutral.positions;
  const double size = (example.colwise().maxCoeff() - example.colwise().minCoeff()).maxCoeff();
  for (Eigen::Index v = 0; v < example.rows(); ++v) example(v, 1) += 0.01 * size * std::sin(20 * example(v, 0) / size);
  const ExpressionTransfer transfer(rig, rig, {});
  EXPECT_TRUE(transfer.sameMesh());
  const auto result = transfer.transfer(std::vector{example, rig.neutral.positions});
  // What the artist let pass on the source passes on the target: contacts change nothing.
  EXPECT_LT((result[0] - example).rowwise().norm().maxCoeff(), 1e-6 * size);
  EXPECT_LT((result[1] - rig.neutral.positions).rowwise().norm().maxCoeff(), 1e-9 * size);
}

// Truth: the artists' expressions of the generic head, as displacements on another person.
TEST(ExpressionTransfer, ArtistsExpressionsArriveOnAnotherPersonByEitherMethod) {
  VOLTO_REQUIRE_DATA(data);
  const std::filesystem::path ict = data / "meshes/ict";
  const rig::Rig source = annotated(ict / "neutral.obj", "ict_feature_points.json");
  const rig::Rig target = annotated(ict / "person_b.obj", "ict_feature_points.json");
  const MeshSet examples = readMeshSet(ict / "expressions", source.neutral);
  EvaluationScope narrow_face;
  narrow_face.end_vertex = 6706;
  const auto errorOf = [&](Method method) {
    const ExpressionTransfer transfer(source, target, {.method = method});
    const Evaluation e = evaluate(target.neutral, source.neutral.positions, examples.names, transfer.transfer(examples.positions),
                                  examples.positions, narrow_face);
    return e.mean_relative;
  };
  const double deformation = errorOf(Method::deformation), mask = errorOf(Method::mask);
  RecordProperty("deformation", std::to_string(deformation));
  RecordProperty("mask", std::to_string(mask));
  EXPECT_LT(deformation, 0.10);
  EXPECT_LT(mask, 0.36);
}

// Truth: eyes that are shut, and a face that does not move where the source's does not. The other topology has a tenth of
// the source's vertices.
TEST(ExpressionTransfer, EyesCloseOnAHeadOfAnotherTopology) {
  VOLTO_REQUIRE_DATA(data);
  const std::filesystem::path ict = data / "meshes/ict";
  const rig::Rig source = annotated(ict / "neutral.obj", "ict_feature_points.json");
  const rig::Rig target =
      annotated(data / "meshes/makehuman/caucasian-female-young/neutral.obj", "makehuman_feature_points.json");
  const auto example = [&](const char* name) { return rig::readMesh(ict / "expressions" / name).positions; };
  const ExpressionTransfer transfer(source, target, {});
  EXPECT_FALSE(transfer.sameMesh());
  EXPECT_GT(transfer.correspondingVertices(), 1000U);
  const auto result = transfer.transfer(std::vector{example("eyeBlink_L.obj"), source.neutral.positions,
                                                    example("mouthClose.obj"), example("jawOpen.obj")});
  const double es = target.fapu.fapu.eye_separation;
  EXPECT_LT((result[1] - target.neutral.positions).rowwise().norm().maxCoeff(), 1e-6 * es);
  const auto gap = [&](std::string_view upper, std::string_view lower, const rig::VertexPositions& at) {
    const auto u = target.feature_vertex[rig::featurePointIndex(upper).value()];
    const auto l = target.feature_vertex[rig::featurePointIndex(lower).value()];
    return (at.row(u) - at.row(l)).norm() / es;
  };
  EXPECT_GT(gap("3.1", "3.3", target.neutral.positions), 0.12);
  EXPECT_LT(gap("3.1", "3.3", result[0]), 0.04);
  EXPECT_NEAR(gap("3.2", "3.4", result[0]), gap("3.2", "3.4", target.neutral.positions), 0.02);
  // In every column from corner to corner, as the contacts see it. Measured: 0.013.
  const auto widest = [&](rig::SlitContact::Place place, const rig::VertexPositions& at) {
    std::vector<std::array<float, 3>> positions;
    for (Eigen::Index v = 0; v < at.rows(); ++v)
      positions.push_back({static_cast<float>(at(v, 0)), static_cast<float>(at(v, 1)), static_cast<float>(at(v, 2))});
    float out = 0;
    for (const rig::SlitContact& slit : target.contacts.slits)
      if (slit.place == place)
        for (const float g : rig::slitGaps(slit, positions)) out = std::max(out, g);
    return out / es;
  };
  EXPECT_LT(widest(rig::SlitContact::Place::left_eye, result[0]), 0.02);
  EXPECT_GT(widest(rig::SlitContact::Place::right_eye, result[0]), 0.12);

  // mouthClose is made for an open jaw (the source's own has 597 triangles of the skin inside out, by itself).
  const rig::VertexPositions shut = together(target.neutral.positions, result[2], result[3]);
  EXPECT_GT(widest(rig::SlitContact::Place::mouth, result[3]), 0.4);
  EXPECT_LT(widest(rig::SlitContact::Place::mouth, shut), 0.01);
  EXPECT_LT(rig::measurePenetration(target.contacts, rig::inSinglePrecision(shut)).lips / es, 0.002);
  for (const auto& t : skinTriangles(target).triangles) {
    const Eigen::Vector3d at_rest = normalOf(target.neutral.positions, t);
    for (const rig::VertexPositions* p : {&result[0], &result[3], &shut})
      EXPECT_GE(at_rest.dot(normalOf(*p, t)), 0) << "triangle at " << target.neutral.positions.row(t[0]);
  }
}

// An open mouth: the upper teeth stay, the lower ones go with the chin though the artist left the tongue behind.
TEST(ExpressionTransfer, MouthOpensWithItsLowerTeeth) {
  VOLTO_REQUIRE_DATA(data);
  const std::filesystem::path ict = data / "meshes/ict", makehuman = data / "meshes/makehuman/asian-male-old";
  const rig::Rig source = annotated(makehuman / "neutral.obj", "makehuman_feature_points.json");
  const rig::Rig target = annotated(ict / "neutral.obj", "ict_feature_points.json");
  const auto result =
      ExpressionTransfer(source, target).transfer(std::vector{rig::readMesh(makehuman / "expressions/mouth-open.obj").positions});
  const double es = target.fapu.fapu.eye_separation;
  const auto meanMotion = [&](std::string_view part) {
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    double count = 0;
    for (const rig::RigidPart& p : target.rigid_parts)
      if (p.name == part)
        for (const std::uint32_t v : p.vertices) {
          sum += result[0].row(v) - target.neutral.positions.row(v);
          ++count;
        }
    return (sum / std::max(count, 1.0) / es).norm();
  };
  EXPECT_LT(meanMotion("upper teeth"), 1e-6);
  EXPECT_GT(meanMotion("lower teeth"), 0.3);
  // The gums of both jaws are one piece (vertices 14062-17038): in front, the upper ones (above all lower teeth) stay.
  for (Eigen::Index v = 14062; v < 17039; ++v) {
    const Eigen::RowVector3d at_rest = target.neutral.positions.row(v);
    if (at_rest.z() < 8.5 || at_rest.y() < -2.5) continue;
    EXPECT_LT((result[0].row(v) - at_rest).norm() / es, 0.02) << v;
  }
}

}  // namespace
}  // namespace volto::transfer
