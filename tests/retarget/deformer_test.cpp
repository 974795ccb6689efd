#include "retarget/deformer.h"

#include <cmath>
#include <cstring>
#include <limits>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "retarget/mask_scale.h"
#include "retarget/retargeter.h"
#include "tests/retarget/synthetic_rig.h"

namespace volto::retarget {
namespace {

using test::deformReference;
using test::syntheticExpression;
using test::syntheticRig;

std::vector<Vertex> neutralOf(const rig::Rig& rig) {
  std::vector<Vertex> out;
  for (Eigen::Index v = 0; v < rig.neutral.positions.rows(); ++v) {
    const auto row = rig.neutral.positions.row(v).cast<float>();
    out.push_back({row[0], row[1], row[2]});
  }
  return out;
}

// Largest distance between the mesh and the reference, as a fraction of the eye separation.
double worstError(const rig::Rig& rig, const std::vector<Vertex>& mesh, const rig::VertexPositions& reference) {
  double worst = 0.0;
  for (std::size_t v = 0; v < mesh.size(); ++v) {
    const auto row = reference.row(static_cast<Eigen::Index>(v));
    worst = std::max(worst, std::hypot(mesh[v][0] - row[0], mesh[v][1] - row[1], mesh[v][2] - row[2]));
  }
  return worst / rig.fapu.fapu.eye_separation;
}

std::vector<Vertex> deformed(const rig::Rig& rig, const MaskDisplacements& displacement) {
  const Deformer deformer(rig.deformation, neutralOf(rig));
  MeshMaskDisplacement in_mesh;
  MaskScale(rig).apply(displacement, in_mesh);
  std::vector<Vertex> out(deformer.vertexCount(), Vertex{-99, -99, -99});  // a vertex that is left out will show
  deformer.deform(in_mesh, out);
  return out;
}

TEST(Deformer, IsNeutralPlusOperatorTimesMask) {
  for (const std::size_t side : {1U + 1U, 7U, 40U, 83U}) {
    const rig::Rig rig = syntheticRig({.skin_side = side});
    for (const std::uint32_t seed : {1U, 2U, 3U}) {
      const MaskDisplacements displacement = syntheticExpression(seed, 0.3F);
      EXPECT_LT(worstError(rig, deformed(rig, displacement), deformReference(rig, displacement)), 2e-5)
          << side << " " << seed;
    }
  }
}

TEST(Deformer, NoDisplacementIsNeutralToTheBit) {
  rig::Rig rig = syntheticRig();
  rig.neutral.positions(17, 1) = -0.0;
  const std::vector<Vertex> neutral = neutralOf(rig), mesh = deformed(rig, MaskDisplacements{});
  ASSERT_EQ(mesh.size(), neutral.size());
  EXPECT_EQ(std::memcmp(mesh.data(), neutral.data(), mesh.size() * sizeof(Vertex)), 0);
}

TEST(Deformer, VerticesWithoutWeightsStayToTheBit) {
  const rig::Rig rig = syntheticRig();
  const std::vector<Vertex> neutral = neutralOf(rig), mesh = deformed(rig, syntheticExpression(4));
  std::size_t still = 0;
  for (std::size_t v = 0; v < mesh.size(); ++v) {
    if (rig.deformation.row_start[v] != rig.deformation.row_start[v + 1]) continue;
    ++still;
    EXPECT_EQ(mesh[v], neutral[v]) << v;
  }
  EXPECT_GT(still, 120U);
}

// 16-bit weights: when all points move alike, a row that sums to one moves exactly along, because rounding keeps the
// sum.
TEST(Deformer, CommonTranslationCarriesOverWithoutRoundingError) {
  rig::Rig rig = syntheticRig();
  MeshMaskDisplacement all;
  all.fill({0.5F, -0.25F, 0.125F});
  const Deformer deformer(rig.deformation, neutralOf(rig));
  std::vector<Vertex> out(deformer.vertexCount());
  deformer.deform(all, out);
  rig::VertexPositions expected = rig.neutral.positions;
  for (std::size_t v = 0; v < deformer.vertexCount(); ++v) {
    double sum = 0.0;
    for (auto i = rig.deformation.row_start[v]; i < rig.deformation.row_start[v + 1]; ++i) {
      sum += static_cast<double>(rig.deformation.weight[i]);
    }
    expected.row(static_cast<Eigen::Index>(v)) += sum * Eigen::RowVector3d(0.5, -0.25, 0.125);
  }
  EXPECT_LT(worstError(rig, out, expected), 3e-5);
}

TEST(Deformer, SizeAndFrameOfTheMeshDoNotMatter) {
  for (const double size : {1e-3, 1.0, 250.0}) {
    rig::Rig rig = syntheticRig({.size = size});
    rig.mesh_from_head = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
    const MaskDisplacements displacement = syntheticExpression(5, 0.3F);
    EXPECT_LT(worstError(rig, deformed(rig, displacement), deformReference(rig, displacement)), 2e-5) << size;
  }
}

TEST(Deformer, EveryVertexCanFollowEveryPoint) {
  rig::Rig rig = syntheticRig({.skin_side = 6, .neighbours = 83});
  const MaskDisplacements displacement = syntheticExpression(6, 0.3F);
  EXPECT_LT(worstError(rig, deformed(rig, displacement), deformReference(rig, displacement)), 4e-5);
}

TEST(Deformer, BrokenOperatorsAreRefused) {
  const rig::Rig rig = syntheticRig({.skin_side = 6});
  const std::vector<Vertex> neutral = neutralOf(rig);
  const auto refused = [&](auto breakIt) {
    rig::DeformationOperator op = rig.deformation;
    breakIt(op);
    EXPECT_THROW(Deformer(op, neutral), std::invalid_argument);
  };
  refused([](auto& op) { op.row_start.pop_back(); });
  refused([](auto& op) { op.row_start.back() += 1; });
  refused([](auto& op) { std::swap(op.row_start.front(), op.row_start.back()); });
  refused([](auto& op) { op.point[3] = 84; });
  refused([](auto& op) { op.weight[3] = std::numeric_limits<float>::quiet_NaN(); });
  refused([](auto& op) { op.weight.pop_back(); });
  std::vector<Vertex> hole = neutral;
  hole[2][1] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(Deformer(rig.deformation, hole), std::invalid_argument);
  std::vector<Vertex> too_small(neutral.size() - 1);
  EXPECT_THROW(Deformer(rig.deformation, neutral).deform({}, too_small), std::invalid_argument);
}

TEST(Deformer, EmptyMeshIsFine) {
  const Deformer deformer(rig::DeformationOperator{}, {});
  std::vector<Vertex> out;
  MeshMaskDisplacement some;
  some.fill({1, 1, 1});
  deformer.deform(some, out);
  EXPECT_EQ(deformer.vertexCount(), 0U);
}

}  // namespace
}  // namespace volto::retarget
