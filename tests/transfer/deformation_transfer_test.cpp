#include "transfer/deformation_transfer.h"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "rig/mesh_io.h"
#include "tests/support/test_data.h"
#include "tests/transfer/sheet.h"
#include "transfer/evaluation.h"
#include "transfer/mesh_set.h"

namespace volto::transfer {
namespace {

constexpr double kEyeSeparation = 6;

std::vector<rig::VertexPositions> carry(const rig::Mesh& source, const rig::Mesh& target, Correspondence correspondence,
                                        std::vector<SlitPair> pairs, std::vector<rig::VertexPositions> examples,
                                        DeformationTransferOptions options = {}) {
  const auto source_triangles = rig::triangulate(source), target_triangles = rig::triangulate(target);
  const DeformationTransfer transfer(source.positions, source_triangles, target.positions, target_triangles, {},
                                     std::move(correspondence), std::move(pairs), kEyeSeparation, options);
  return transfer.transfer(examples);
}

double worst(const rig::VertexPositions& a, const rig::VertexPositions& b) {
  return (a - b).rowwise().norm().maxCoeff();
}

TEST(DeformationTransfer, SourceItselfGetsItsOwnExpression) {
  const Sheet sheet = makeSheet(18, 12, 0.8);
  const rig::VertexPositions example = curled(sheet, 1.2);
  const auto result = carry(sheet.mesh, sheet.mesh, sameTopology(sheet.mesh), {}, {example});
  EXPECT_LT(worst(result[0], example), 1e-9);
  EXPECT_GT(worst(example, sheet.mesh.positions), 1.0);
}

TEST(DeformationTransfer, SourceAtRestLeavesTargetAtRest) {
  const Sheet source = makeSheet(18, 12, 0.8);
  Sheet target = source;
  target.mesh.positions.col(1) *= 1.3;
  const auto result =
      carry(source.mesh, target.mesh, sameTopology(source.mesh), pairsOf(source, target), {source.mesh.positions});
  EXPECT_LT(worst(result[0], target.mesh.positions), 1e-9);
}

// A larger, turned copy does the same thing, larger and turned: found by reasoning, not by the program.
TEST(DeformationTransfer, TurnedAndEnlargedTargetDoesTheSameTurnedAndEnlarged) {
  const Sheet source = makeSheet(18, 12, 0.8);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.9, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  const double size = 3.7;
  const auto moved = [&](const rig::VertexPositions& p) {
    return rig::VertexPositions((size * (p * turn.transpose())).rowwise() + Eigen::RowVector3d(5, -3, 100));
  };
  Sheet target = source;
  target.mesh.positions = moved(source.mesh.positions);
  Correspondence correspondence = sameTopology(source.mesh);
  correspondence.target_from_source = turn;
  correspondence.displacement_scale = {Eigen::Vector3d::Constant(size)};
  const rig::VertexPositions example = curled(source, 0.8);
  const auto result = carry(source.mesh, target.mesh, correspondence, {}, {example});
  EXPECT_LT(worst(result[0], moved(example)), 1e-8);
}

TEST(DeformationTransfer, LidThatClosesOnSourceClosesOnWiderEye) {
  const Sheet source = makeSheet(18, 12, 0.6), target = makeSheet(18, 12, 1.4);
  const rig::VertexPositions example = closed(source, 1.0);
  const auto gapOf = [&](const rig::VertexPositions& p) {
    double widest = 0;
    for (std::size_t k = 0; k < target.upper.size(); ++k)
      widest = std::max(widest, (p.row(target.upper[k]) - p.row(target.lower[k])).norm());
    return widest;
  };
  const auto without = carry(source.mesh, target.mesh, sameTopology(source.mesh), {}, {example});
  const auto with = carry(source.mesh, target.mesh, sameTopology(source.mesh), pairsOf(source, target), {example},
                          {.slit_stiffness = 100});
  EXPECT_GT(gapOf(without[0]), 0.2);
  EXPECT_LT(gapOf(with[0]), 0.02);
}

TEST(DeformationTransfer, WhatNothingStandsForStaysWhereItIs) {
  const Sheet sheet = makeSheet(18, 12, 0.8);
  Correspondence correspondence = sameTopology(sheet.mesh);
  for (std::size_t v = 0; v < correspondence.source_point.size(); ++v)
    if (sheet.mesh.positions(static_cast<Eigen::Index>(v), 1) < 3) correspondence.source_point[v].weight = {0, 0, 0};
  const auto triangles = rig::triangulate(sheet.mesh);
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (sheet.mesh.positions(triangles[t][0], 1) < 3) correspondence.source_triangle[t] = Correspondence::kNone;
  const auto result = carry(sheet.mesh, sheet.mesh, correspondence, {}, {closed(sheet, 1.0)});
  EXPECT_LT((result[0] - sheet.mesh.positions).topRows(10).rowwise().norm().maxCoeff(), 0.01);
  EXPECT_GT((result[0] - sheet.mesh.positions).rowwise().norm().maxCoeff(), 0.5);
}

TEST(DeformationTransfer, OneThreadAndManyGiveTheSameBits) {
  const Sheet source = makeSheet(18, 12, 0.6), target = makeSheet(18, 12, 1.0);
  std::vector<rig::VertexPositions> examples;
  for (int i = 1; i <= 30; ++i) examples.push_back(curled(source, 0.05 * i));
  const auto one =
      carry(source.mesh, target.mesh, sameTopology(source.mesh), pairsOf(source, target), examples, {.threads = 1});
  const auto four =
      carry(source.mesh, target.mesh, sameTopology(source.mesh), pairsOf(source, target), examples, {.threads = 4});
  for (std::size_t i = 0; i < examples.size(); ++i) EXPECT_EQ(one[i], four[i]) << "example " << i;
}

TEST(DeformationTransfer, SeamOfTextureCoordinatesDoesNotOpen) {
  Sheet sheet = makeSheet(18, 12, 0.8);
  // The last vertex once more, as a file with texture coordinates has it; the last square uses the copy.
  rig::Mesh split = sheet.mesh;
  const auto last = static_cast<std::uint32_t>(split.vertexCount() - 1);
  split.positions.conservativeResize(split.positions.rows() + 1, 3);
  split.positions.row(split.positions.rows() - 1) = split.positions.row(last);
  for (std::uint32_t c = split.polygon_start[split.polygonCount() - 1]; c < split.corner_vertices.size(); ++c)
    if (split.corner_vertices[c] == last) split.corner_vertices[c] = last + 1;
  std::vector<std::uint32_t> same_as;
  for (std::uint32_t v = 0; v <= last; ++v) same_as.push_back(v);
  same_as.push_back(last);
  rig::VertexPositions example = curled(sheet, 1.0);
  example.conservativeResize(example.rows() + 1, 3);
  example.row(example.rows() - 1) = example.row(last);
  const auto triangles = rig::triangulate(split);
  const DeformationTransfer transfer(split.positions, triangles, split.positions, triangles, same_as,
                                     sameTopology(split), {}, kEyeSeparation);
  const auto result = transfer.transfer(std::vector{example});
  EXPECT_EQ(result[0].row(last), result[0].row(last + 1));
  EXPECT_LT(worst(result[0], example), 1e-9);
}

TEST(DeformationTransfer, ExampleWithOtherVerticesIsRefused) {
  const Sheet sheet = makeSheet(18, 12, 0.8);
  EXPECT_THROW(carry(sheet.mesh, sheet.mesh, sameTopology(sheet.mesh), {}, {rig::VertexPositions::Zero(7, 3)}),
               std::invalid_argument);
  EXPECT_THROW(carry(sheet.mesh, sheet.mesh, Correspondence{}, {}, {}), std::invalid_argument);
}

// Truth: the artists' expressions of the generic head, as displacements on another person.
TEST(DeformationTransfer, ArtistsExpressionsArriveOnOtherPeople) {
  VOLTO_REQUIRE_DATA(data);
  const std::filesystem::path ict = data / "meshes/ict";
  const rig::Mesh generic = rig::readMesh(ict / "neutral.obj");
  const MeshSet examples = readMeshSet(ict / "expressions", generic);
  const auto triangles = rig::triangulate(generic);
  for (const char* person : {"person_a.obj", "person_b.obj"}) {
    const rig::Mesh target = rig::readMesh(ict / person);
    const DeformationTransfer transfer(generic.positions, triangles, target.positions, triangles, {},
                                       sameTopology(generic), {}, 6.2);
    const auto results = transfer.transfer(examples.positions);
    EvaluationScope narrow_face;
    narrow_face.end_vertex = 6706;
    const Evaluation e = evaluate(target, generic.positions, examples.names, results, examples.positions, narrow_face);
    EXPECT_EQ(e.related, 53U);
    EXPECT_LT(e.mean_relative, 0.10) << person;
    RecordProperty(person, std::to_string(e.mean_relative));
  }
}

}  // namespace
}  // namespace volto::transfer
