#include "retarget/blendshape_set.h"

#include <fstream>
#include <random>
#include <sstream>

#include <gtest/gtest.h>

#include "retarget/face_deformer.h"
#include "retarget/shape_relations.h"
#include "retarget/weight_solver.h"
#include "rig/build_rig.h"
#include "rig/errors.h"
#include "rig/mesh_io.h"
#include "tests/retarget/synthetic_rig.h"
#include "tests/support/test_data.h"

namespace volto::retarget {
namespace {

// A bump here and there: nothing that the rig's own regions could make.
rig::VertexPositions bumped(const rig::Rig& rig, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<Eigen::Index> any(0, 1599);  // of the skin
  rig::VertexPositions out = rig.neutral.positions;
  const double es = rig.fapu.fapu.eye_separation;
  for (int i = 0; i < 5; ++i) {
    const Eigen::RowVector3d centre = rig.neutral.positions.row(any(random));
    for (Eigen::Index v = 0; v < 1600; ++v) {
      const double d = (rig.neutral.positions.row(v) - centre).norm() / es;
      out.row(v) += 0.1 * es * std::exp(-20 * d * d) * Eigen::RowVector3d(0.3, -0.5, 1);
    }
  }
  return out;
}

std::string complaint(rig::Rig rig, std::vector<std::string> names, std::vector<rig::VertexPositions> positions) {
  try {
    replaceBlendshapes(rig, names, positions);
  } catch (const rig::InputError& error) {
    return error.what();
  }
  return {};
}

TEST(BlendshapeSet, AShapeAtFullWeightIsTheMeshItCameFrom) {
  rig::Rig rig = test::syntheticRig();
  const std::vector<std::string> names{"A", "O", "smug"};
  const std::vector<rig::VertexPositions> meshes{bumped(rig, 1), bumped(rig, 2), rig.neutral.positions};
  EXPECT_EQ(replaceBlendshapes(rig, names, meshes), std::vector<std::string>{"smug"});
  ASSERT_EQ(rig.blendshapes.size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    std::vector<float> weights(3, 0.0F);
    weights[k] = 1;
    const std::vector<Vertex> reached = deformAtWeights(rig, weights);
    for (std::size_t v = 0; v < 1600; ++v)
      for (std::size_t axis = 0; axis < 3; ++axis)
        ASSERT_NEAR(reached[v][axis], meshes[k](static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(axis)),
                    1e-5 * rig.fapu.fapu.eye_separation)
            << names[k] << " vertex " << v;
  }
}

TEST(BlendshapeSet, AShapeNamedAfterOthersIsTheirCombination) {
  rig::Rig rig = test::syntheticRig();
  const std::vector<std::string> names{"frown_L", "blink_L", "frown_L+blink_L", "this+that"};
  const std::vector<rig::VertexPositions> meshes{bumped(rig, 1), bumped(rig, 2), bumped(rig, 3), bumped(rig, 4)};
  replaceBlendshapes(rig, names, meshes);
  const ShapeRelations relations = shapeRelations(rig.blendshapes, rig.combinations);
  ASSERT_EQ(relations.driven.size(), 1U);
  EXPECT_EQ(relations.driven[0].shape, 2);
  EXPECT_EQ(relations.driven[0].parents, (std::vector<std::uint16_t>{0, 1}));
  std::vector<float> weights{0.5F, 0.6F, 0.0F, 0.0F};
  relations.drive(weights);
  EXPECT_FLOAT_EQ(weights[2], 0.3F);
  // Its mesh adds to those of its parents: at full weight of all three the sum of the three meshes' displacements.
  const std::vector<Vertex> reached = deformAtWeights(rig, std::vector<float>{1, 1, 1, 0});
  for (Eigen::Index v = 0; v < 1600; ++v) {
    const Eigen::RowVector3d sum =
        meshes[0].row(v) + meshes[1].row(v) + meshes[2].row(v) - 2 * rig.neutral.positions.row(v);
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      ASSERT_NEAR(reached[static_cast<std::size_t>(v)][static_cast<std::size_t>(axis)], sum[axis],
                  1e-4 * rig.fapu.fapu.eye_separation);
  }
}

TEST(BlendshapeSet, WhatIsNoSetIsRefusedByName) {
  const rig::Rig rig = test::syntheticRig();
  const rig::VertexPositions rest = rig.neutral.positions;
  EXPECT_NE(complaint(rig, {}, {}).find("no shapes"), std::string::npos);
  EXPECT_NE(complaint(rig, {"a", "a"}, {rest, rest}).find("two shapes are called 'a'"), std::string::npos);
  EXPECT_NE(complaint(rig, {""}, {rest}).find("shape 0 has no name"), std::string::npos);
  EXPECT_NE(complaint(rig, {"a"}, {rest.topRows(7)}).find("'a' has 7 vertices, the character 1720"), std::string::npos);
  EXPECT_NE(complaint(rig, {"a", "a+b"}, {rest, rest}).find("'a+b' combines 'b', which the set does not have"),
            std::string::npos);
  rig::VertexPositions bad = rest;
  bad(3, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(complaint(rig, {"a"}, {bad}).find("not finite"), std::string::npos);
}

// ICT-FaceKit's head with the 53 expressions that come with it.
rig::Rig ictWithItsOwnSet(const std::filesystem::path& data) {
  const std::filesystem::path ict = data / "meshes/ict";
  std::ifstream file(test::sourceDir() / "tests/rig/ict_feature_points.json");
  std::stringstream text;
  text << file.rdbuf();
  rig::Rig rig = rig::buildRig(rig::readMesh(ict / "neutral.obj"), rig::parseFeaturePoints(text.str(), "ict"));
  std::vector<std::string> names;
  std::vector<rig::VertexPositions> meshes;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(ict / "expressions")) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const auto& f : files) {
    names.push_back(f.stem().string());
    meshes.push_back(rig::readMesh(f).positions);
  }
  EXPECT_TRUE(replaceBlendshapes(rig, names, meshes).empty());
  return rig;
}

// The weights of an artist's own set, from nothing but the motion of the mask.
TEST(BlendshapeSet, SparseWeightsOfAnArtistsSetComeBackFromTheMask) {
  VOLTO_REQUIRE_DATA(data);
  const rig::Rig rig = ictWithItsOwnSet(data);
  const std::size_t n = rig.blendshapes.size();
  const auto indexOf = [&](std::string_view name) {
    for (std::size_t k = 0; k < n; ++k)
      if (rig.blendshapes[k].name == name) return k;
    throw std::logic_error("no such shape");
  };
  const std::size_t close = indexOf("mouthClose"), jaw = indexOf("jawOpen");
  WeightSolver solver(rig);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0, 1);
  double error = 0, too_many = 0;
  constexpr int kFrames = 200;
  MaskFrame in;
  in.point_confidence.fill(1.0F);
  std::vector<float> weights(n);
  std::vector<std::uint8_t> observed(n);
  for (int frame = 0; frame < kFrames; ++frame) {
    std::vector<float> truth(n, 0.0F);
    for (int i = 0; i < 6; ++i) truth[random() % truth.size()] = unit(random);
    truth[close] = std::min(truth[close], truth[jaw]);  // what it means: the lips of an open mouth
    MeshMaskDisplacement motion{};
    for (std::size_t k = 0; k < truth.size(); ++k)
      for (std::size_t p = 0; p < kFeaturePointCount; ++p)
        for (std::size_t axis = 0; axis < 3; ++axis)
          motion[p][axis] += truth[k] * rig.blendshapes[k].mask_displacement[p][axis];
    solver.reset();
    solver.solve(motion, in, weights, observed);
    for (std::size_t k = 0; k < truth.size(); ++k) {
      error += static_cast<double>(std::abs(weights[k] - truth[k]));
      too_many += truth[k] == 0.0F && weights[k] > 0.02F ? 1 : 0;
    }
  }
  error /= kFrames * static_cast<double>(n);
  RecordProperty("mean_error", std::to_string(error));
  RecordProperty("wrongly_shown_per_frame", std::to_string(too_many / kFrames));
  EXPECT_LT(error, 0.012);
  EXPECT_LT(too_many / kFrames, 2.5);
}

}  // namespace
}  // namespace volto::retarget
