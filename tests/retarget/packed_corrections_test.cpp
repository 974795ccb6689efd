#include "retarget/packed_corrections.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "rig/pose.h"

namespace volto::retarget {
namespace {

// Runs of every length, gaps of every length.
rig::SparseDisplacement scattered(unsigned seed, std::uint32_t vertices, float largest) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> anywhere(-largest, largest);
  rig::SparseDisplacement out;
  for (std::uint32_t v = 0; v < vertices;
       v += 1 + static_cast<std::uint32_t>(random() % (random() % 4 == 0 ? 12U : 2U))) {
    out.vertex.push_back(v);
    out.displacement.push_back({anywhere(random), anywhere(random), anywhere(random)});
  }
  return out;
}

TEST(PackedCorrections, MoveTheMeshAsThoseOfTheRigDo) {
  constexpr std::uint32_t kVertices = 500;
  rig::Rig rig;
  for (unsigned k = 0; k < 4; ++k) {
    rig.blendshapes.push_back({});
    rig.blendshapes.back().correction = scattered(k, kVertices, 0.5F);
  }
  rig.blendshapes[1].correction = {};  // most shapes have none
  rig.combinations.push_back({"both", rig::Combination::Rule::product, {{0}, {2}}, scattered(7, kVertices, 2.0F)});
  rig.combinations.push_back({"more", rig::Combination::Rule::excess, {{3}, {2}}, scattered(8, kVertices, 1.0F)});
  const std::vector<float> weights = {0.3F, 1.0F, 0.6F, 0.9F};
  std::vector<Vertex> neutral(kVertices, Vertex{1, 2, 3}), expected = neutral, moved = neutral;
  rig::addToPose(rig, weights, true, neutral, expected);
  PackedCorrections(rig).addTo(weights, moved);
  double farthest = 0;
  for (std::size_t v = 0; v < kVertices; ++v) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(moved[v][axis], expected[v][axis], 1e-4) << "vertex " << v;
      farthest = std::max(farthest, std::abs(static_cast<double>(moved[v][axis]) - neutral[v][axis]));
    }
    if (expected[v] == neutral[v]) {
      EXPECT_EQ(moved[v], neutral[v]) << "vertex " << v << " between two runs";
    }
  }
  EXPECT_GT(farthest, 0.5);
}

TEST(PackedCorrections, WithoutWeightsNothingMovesToTheBit) {
  rig::Rig rig;
  rig.blendshapes.push_back({});
  rig.blendshapes.back().correction = scattered(3, 50, 1.0F);
  std::vector<Vertex> mesh(50, Vertex{0.1F, 0.2F, 0.3F});
  const std::vector<Vertex> before = mesh;
  PackedCorrections(rig).addTo(std::vector<float>{0.0F}, mesh);
  EXPECT_EQ(mesh, before);
}

}  // namespace
}  // namespace volto::retarget
