#include "retarget/blendshape_set.h"

#include <fstream>
#include <random>
#include <sstream>

#include <gtest/gtest.h>

#include "retarget/face_deformer.h"
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

TEST(BlendshapeSet, WhatIsNoSetIsRefusedByName) {
  const rig::Rig rig = test::syntheticRig();
  const rig::VertexPositions rest = rig.neutral.positions;
  EXPECT_NE(complaint(rig, {}, {}).find("no shapes"), std::string::npos);
  EXPECT_NE(complaint(rig, {"a", "a"}, {rest, rest}).find("two shapes are called 'a'"), std::string::npos);
  EXPECT_NE(complaint(rig, {""}, {rest}).find("shape 0 has no name"), std::string::npos);
  EXPECT_NE(complaint(rig, {"a"}, {rest.topRows(7)}).find("'a' has 7 vertices, the character 1720"), std::string::npos);
  rig::VertexPositions bad = rest;
  bad(3, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(complaint(rig, {"a"}, {bad}).find("not finite"), std::string::npos);
}

// The weights of an artist's own set, from nothing but the motion of the mask.
TEST(BlendshapeSet, SparseWeightsOfAnArtistsSetComeBackFromTheMask) {
  VOLTO_REQUIRE_DATA(data);
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
  WeightSolver solver(rig.blendshapes, rig.fapu.fapu.eye_separation);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0, 1);
  double error = 0;
  constexpr int kFrames = 200;
  MaskFrame in;
  in.point_confidence.fill(1.0F);
  std::vector<float> weights(names.size());
  std::vector<std::uint8_t> observed(names.size());
  for (int frame = 0; frame < kFrames; ++frame) {
    std::vector<float> truth(names.size(), 0.0F);
    for (int i = 0; i < 6; ++i) truth[random() % truth.size()] = unit(random);
    MeshMaskDisplacement motion{};
    for (std::size_t k = 0; k < truth.size(); ++k)
      for (std::size_t p = 0; p < kFeaturePointCount; ++p)
        for (std::size_t axis = 0; axis < 3; ++axis)
          motion[p][axis] += truth[k] * rig.blendshapes[k].mask_displacement[p][axis];
    solver.reset();
    solver.solve(motion, in, weights, observed);
    for (std::size_t k = 0; k < truth.size(); ++k) error += std::abs(weights[k] - truth[k]);
  }
  error /= kFrames * static_cast<double>(names.size());
  RecordProperty("mean_error", std::to_string(error));
  EXPECT_LT(error, 0.02);
}

}  // namespace
}  // namespace volto::retarget
