#include "transfer/matched_shapes.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "rig/errors.h"
#include "tests/transfer/sheet.h"

namespace volto::transfer {
namespace {

TEST(MatchedShapes, OtherFrameAndUnitAreTakenBack) {
  const Sheet sheet = makeSheet(12, 8, 0.6);
  const rig::VertexPositions shape = curled(sheet, 0.7);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.3, Eigen::Vector3d(1, 1, -2).normalized()).toRotationMatrix();
  const auto elsewhere = [&](const rig::VertexPositions& p) {
    return rig::VertexPositions((0.01 * p * turn.transpose()).rowwise() + Eigen::RowVector3d(1, 2, 3));
  };
  rig::ShapedMesh read{sheet.mesh, {"curl"}, {elsewhere(shape)}};
  read.mesh.positions = elsewhere(sheet.mesh.positions);
  const auto back = matchedShapes(sheet.mesh, read, "m");
  EXPECT_LT((back[0] - shape).rowwise().norm().maxCoeff(), 1e-9);
}

TEST(MatchedShapes, SplitVerticesAreFoundAtTheirPlaces) {
  const Sheet sheet = makeSheet(12, 8, 0.6);
  const rig::VertexPositions shape = curled(sheet, 0.7);
  // Every vertex twice, backwards.
  rig::ShapedMesh read;
  read.names = {"curl"};
  const Eigen::Index n = shape.rows();
  read.mesh.positions.resize(2 * n, 3);
  read.positions.emplace_back(2 * n, 3);
  for (Eigen::Index v = 0; v < 2 * n; ++v) {
    read.mesh.positions.row(v) = sheet.mesh.positions.row((2 * n - 1 - v) / 2);
    read.positions[0].row(v) = shape.row((2 * n - 1 - v) / 2);
  }
  EXPECT_EQ(matchedShapes(sheet.mesh, read, "m")[0], shape);
}

TEST(MatchedShapes, AnotherMeshIsRefusedWithBothCounts) {
  const Sheet sheet = makeSheet(12, 8, 0.6), other = makeSheet(10, 8, 0.6);
  rig::ShapedMesh read{other.mesh, {"curl"}, {other.mesh.positions}};
  read.mesh.positions.col(0).array() += 5;
  try {
    matchedShapes(sheet.mesh, read, "head.glb");
    FAIL();
  } catch (const rig::InputError& error) {
    EXPECT_EQ(std::string(error.what()),
              "head.glb: its mesh has " + std::to_string(other.mesh.vertexCount()) + " vertices, the character " +
                  std::to_string(sheet.mesh.vertexCount()) +
                  ", and they are not at the same places; give shapes of the character's own mesh");
  }
}

}  // namespace
}  // namespace volto::transfer
