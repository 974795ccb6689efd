// The shipped characters through everything that moves them: operator, parts, corrections, contacts.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "retarget/expression_health.h"
#include "retarget/face_deformer.h"
#include "rig/build_rig.h"
#include "rig/mesh_io.h"
#include "rig/pose.h"
#include "rig/prepared_contacts.h"
#include "tests/retarget/allocation_counter.h"
#include "tests/support/test_data.h"

namespace volto::retarget {
namespace {

using Weights = std::vector<std::pair<std::string_view, float>>;

class HeadExpressions : public ::testing::TestWithParam<const char*> {
 protected:
  static const rig::Rig& rig() {
    static std::map<std::string, rig::Rig> made;
    const std::string name = GetParam();
    if (const auto it = made.find(name); it != made.end()) return it->second;
    const auto folder = volto::test::sourceDir() / "rig/assets";
    std::ifstream file(folder / (name + ".points.json"));
    const std::string json{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    return made[name] = rig::buildRig(rig::readMesh(folder / (name + ".obj")),
                                      rig::parseFeaturePoints(json, name + ".points.json"));
  }
  static std::vector<Vertex> posed(const Weights& weights) {
    return deformAtWeights(rig(), weightsByName(rig(), weights));
  }
  static float es() { return static_cast<float>(rig().fapu.fapu.eye_separation); }
  static float heightOf(std::string_view id, const std::vector<Vertex>& pose) {
    return pose[static_cast<std::size_t>(rig().feature_vertex[rig::featurePointIndex(id).value()])][1];
  }
  static const rig::PartMotion* motionOf(rig::RigidPart::Follows follows) {
    for (const rig::PartMotion& m : rig().part_motions)
      if (m.follows == follows) return &m;
    return nullptr;
  }
};

float distance(const Vertex& a, const Vertex& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

TEST_P(HeadExpressions, HealthIsTheSameWhicheverWayPolygonsRun) {
  rig::Rig inside_out = rig();
  rig::Mesh& mesh = inside_out.neutral;
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p)
    std::reverse(mesh.corner_vertices.begin() + mesh.polygon_start[p] + 1,  // quads are cut the same way
                 mesh.corner_vertices.begin() + mesh.polygon_start[p + 1]);
  const HealthMeasure one(rig()), other(inside_out);
  // Lips and lids far into each other, as no contact leaves them.
  std::vector<Vertex> pose = rig::neutralPositions(rig());
  for (const rig::SlitContact& slit : rig().contacts.slits)
    for (std::size_t i = 0; i < slit.vertex.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis)
        pose[slit.vertex[i]][axis] -= 0.05F * es() * slit.share[i] * slit.up[axis];
  const PoseHealth a = one.measure("", pose), b = other.measure("", pose);
  EXPECT_GT(a.lips_depth_es, 0.005);
  EXPECT_NEAR(a.lips_depth_es, b.lips_depth_es, 1e-3);
  EXPECT_NEAR(a.lids_depth_es, b.lids_depth_es, 1e-3);
}

TEST_P(HeadExpressions, NoWeightsAreNeutralToTheBit) { EXPECT_EQ(posed({}), rig::neutralPositions(rig())); }

TEST_P(HeadExpressions, NothingFoldsPassesOrGapes) {
  const ExpressionHealth health = measureExpressions(rig());
  EXPECT_EQ(health.shapes.size(), 52U);
  EXPECT_EQ(health.combinations.size(), 12U);
  EXPECT_LT(health.blink_gap_es, 0.01);
  EXPECT_LT(health.symmetry_es, 1e-4);
  EXPECT_EQ(health.border_es, 0.0);
  const PoseHealth worst = health.worst();
  EXPECT_LT(worst.eyeball_depth_es, 0.005);
  EXPECT_LT(worst.lids_depth_es, 0.005);
  EXPECT_LT(worst.lips_depth_es, 0.005);
  EXPECT_EQ(health.flipped(), 0U) << worst.name;
  EXPECT_EQ(health.degenerate(), 0U) << worst.name;
}

TEST_P(HeadExpressions, LidsStayOnTheEyeballAllTheWay) {
  HealthMeasure measure(rig());
  for (const float w : {0.25F, 0.5F, 0.75F, 1.0F})
    EXPECT_LT(measure.measureWeights("blink", weightsByName(rig(), Weights{{"eyeBlinkLeft", w}})).eyeball_depth_es,
              0.005)
        << w;
}

TEST_P(HeadExpressions, MixturesThatNobodyChoseDoNotFoldEither) {
  HealthMeasure measure(rig());
  std::uint32_t state = 1;
  const auto random = [&state] {  // 0..1, the same everywhere
    state = state * 1664525U + 1013904223U;
    return static_cast<float>(state >> 8) / static_cast<float>(1U << 24);
  };
  std::size_t flipped = 0;
  for (int pose = 0; pose < 40; ++pose) {
    std::vector<float> weights(rig().blendshapes.size(), 0.0F);
    for (int i = 0; i < 6; ++i) {
      const auto k = static_cast<std::size_t>(random() * static_cast<float>(weights.size() - 1));
      weights[k] = random();
    }
    const PoseHealth health = measure.measureWeights("mixture", weights);
    flipped += health.flipped;
    EXPECT_LT(health.eyeball_depth_es, 0.005) << pose;
  }
  EXPECT_EQ(flipped, 0U) << "of 40 poses of some 39 600 triangles each";
}

TEST_P(HeadExpressions, WithoutTheGuardTrianglesFold) {
  rig::Rig unguarded = rig();
  unguarded.contacts.folds = {};
  EXPECT_GT(measureExpressions(unguarded).flipped(), 10U) << "else the guard is not needed, or not measured";
}

TEST_P(HeadExpressions, LowerTeethStayInAChinWhoseLipsClose) {
  const auto open = posed({{"jawOpen", 1.0F}}), closed = posed({{"jawOpen", 1.0F}, {"mouthClose", 1.0F}});
  const auto chin = static_cast<std::size_t>(rig().feature_vertex[rig::featurePointIndex("2.1").value()]);
  const auto lowestOf = [](const rig::PartMotion& part, const std::vector<Vertex>& pose) {
    float lowest = 1e9F;
    for (const std::uint32_t v : part.vertices) lowest = std::min(lowest, pose[v][1]);
    return lowest;
  };
  const rig::PartMotion* jaw = motionOf(rig::RigidPart::Follows::jaw);
  ASSERT_NE(jaw, nullptr);
  EXPECT_GT(lowestOf(*jaw, closed), closed[chin][1]);
  EXPECT_GT(lowestOf(*jaw, closed), lowestOf(*jaw, open));
}

TEST_P(HeadExpressions, ClosedLipsStayClosedWhateverIsAdded) {
  for (const Weights& weights :
       {Weights{{"mouthClose", 1.0F}}, Weights{{"mouthClose", 1.0F}, {"jawOpen", 1.0F}},
        Weights{{"mouthPressLeft", 1.0F}, {"mouthPressRight", 1.0F}, {"mouthShrugLower", 1.0F}}}) {
    const auto pose = posed(weights);
    const float gap = heightOf("2.2", pose) - heightOf("2.3", pose);
    EXPECT_GT(gap, -0.005F * es()) << weights.front().first;
    EXPECT_LT(rig::measurePenetration(rig().contacts, pose).lips, 0.005F * es()) << weights.front().first;
  }
}

TEST_P(HeadExpressions, BlinkStaysClosedUnderSquintAndDownwardGaze) {
  for (const std::string_view with : {"eyeSquintLeft", "eyeLookDownLeft", "cheekSquintLeft"}) {
    const auto pose = posed({{"eyeBlinkLeft", 1.0F}, {with, 1.0F}});
    EXPECT_LT(rig::measurePenetration(rig().contacts, pose).lids, 0.01F * es()) << with;
    EXPECT_LT(heightOf("3.1", pose) - heightOf("3.3", pose), 0.01F * es()) << with;
  }
}

TEST_P(HeadExpressions, LowerTeethTurnRigidlyWithTheJawAtEveryWeight) {
  const rig::PartMotion* jaw = motionOf(rig::RigidPart::Follows::jaw);
  ASSERT_NE(jaw, nullptr);
  const auto rest = posed({});
  const std::uint32_t a = jaw->vertices.front(), b = jaw->vertices.back(), c = jaw->vertices[jaw->vertices.size() / 2];
  for (const float w : {0.3F, 0.6F, 1.0F}) {
    const auto pose = posed({{"jawOpen", w}, {"jawLeft", 0.5F}});
    EXPECT_NEAR(distance(pose[a], pose[b]), distance(rest[a], rest[b]), 1e-4F * es());
    EXPECT_NEAR(distance(pose[a], pose[c]), distance(rest[a], rest[c]), 1e-4F * es());
    EXPECT_GT(rest[a][1] - pose[a][1], 0.02F * es() * w);
  }
  // Lips and cheeks do not take the bone along.
  const auto smile = posed({{"mouthSmileLeft", 1.0F}, {"mouthShrugLower", 1.0F}, {"cheekPuff", 1.0F}});
  EXPECT_LT(distance(smile[a], rest[a]), 1e-5F * es());
}

TEST_P(HeadExpressions, EyesTurnByTheirWeightsAndGazeComesFirst) {
  const rig::PartMotion* eye = motionOf(rig::RigidPart::Follows::left_eye);
  ASSERT_NE(eye, nullptr);
  const auto rest = posed({});
  const auto frontOf = [&](const std::vector<Vertex>& pose) {
    std::uint32_t front = eye->vertices.front();
    for (const std::uint32_t v : eye->vertices)
      if (rest[v][2] > rest[front][2]) front = v;
    return pose[front];
  };
  EXPECT_GT(frontOf(posed({{"eyeLookOutLeft", 1.0F}}))[0], frontOf(rest)[0] + 0.05F * es()) << "to the subject's left";
  EXPECT_GT(frontOf(posed({{"eyeLookUpLeft", 1.0F}}))[1], frontOf(rest)[1] + 0.03F * es());
  const FaceDeformer deformer(rig());
  std::vector<Vertex> out(deformer.vertexCount());
  Gaze ahead;
  ahead.confidence = 1;
  deformer.deform({}, weightsByName(rig(), Weights{{"eyeLookOutLeft", 1.0F}}), ahead, out);
  EXPECT_EQ(frontOf(out), frontOf(rest)) << "a gaze that was seen is where the eyes look";
}

TEST_P(HeadExpressions, TongueComesOutBetweenTheLips) {
  const auto rest = posed({}), pose = posed({{"tongueOut", 1.0F}});
  float lips = -1e9F, tongue = -1e9F;
  for (const std::string_view id : {"8.1", "8.2"})
    lips = std::max(lips, rest[static_cast<std::size_t>(rig().feature_vertex[rig::featurePointIndex(id).value()])][2]);
  for (const std::uint32_t v : motionOf(rig::RigidPart::Follows::jaw)->vertices) tongue = std::max(tongue, pose[v][2]);
  EXPECT_GT(tongue, lips + 0.1F * es());
  EXPECT_GT(heightOf("2.2", pose) - heightOf("2.3", pose), 0.02F * es());
}

TEST_P(HeadExpressions, MouthCloseDoesNothingMuchWithoutAnOpenJaw) {
  const auto rest = posed({}), pose = posed({{"mouthClose", 1.0F}});
  float farthest = 0;
  for (std::size_t v = 0; v < rest.size(); ++v) farthest = std::max(farthest, distance(rest[v], pose[v]));
  EXPECT_LT(farthest, 0.1F * es());
}

TEST_P(HeadExpressions, NothingIsAllocatedPerFrame) {
  const FaceDeformer deformer(rig());
  std::vector<Vertex> out(deformer.vertexCount());
  const auto weights = weightsByName(
      rig(), Weights{{"eyeBlinkLeft", 1.0F}, {"jawOpen", 0.5F}, {"mouthClose", 0.7F}, {"mouthSmileLeft", 0.4F}});
  deformer.deformAtWeights(weights, out);
  const std::size_t before = volto::test::allocationCount();
  deformer.deformAtWeights(weights, out);
  EXPECT_EQ(volto::test::allocationCount(), before);
}

TEST_P(HeadExpressions, FastKernelAgreesWithThePlainOne) {
  const auto weights =
      weightsByName(rig(), Weights{{"mouthSmileRight", 0.8F}, {"browInnerUp", 0.5F}, {"jawOpen", 0.4F}});
  const auto neutral = rig::neutralPositions(rig());
  std::vector<Vertex> plain(neutral.size());
  rig::pose(rig(), weights, neutral, plain);
  const auto fast = deformAtWeights(rig(), weights);
  for (std::size_t v = 0; v < plain.size(); ++v) ASSERT_LT(distance(plain[v], fast[v]), 2e-4F * es()) << v;
}

TEST_P(HeadExpressions, WrongWeightsAreRefused) {
  EXPECT_THROW(deformAtWeights(rig(), std::vector<float>(3)), std::invalid_argument);
  EXPECT_THROW(weightsByName(rig(), Weights{{"noSuchShape", 1.0F}}), std::invalid_argument);
  rig::Rig broken = rig();
  broken.blendshapes[0].correction = {{static_cast<std::uint32_t>(broken.neutral.vertexCount())}, {{0, 0, 0}}};
  EXPECT_THROW(FaceDeformer{broken}, std::invalid_argument);
}

TEST_P(HeadExpressions, PreparedContactsResolveAsThoseOfTheRigToTheBit) {
  const std::vector<Vertex> neutral = rig::neutralPositions(rig());
  const rig::PreparedContacts prepared(rig().contacts, neutral);
  for (const Weights& weights : {Weights{}, Weights{{"eyeBlinkLeft", 1.0F}, {"eyeBlinkRight", 0.7F}},
                                 Weights{{"mouthClose", 1.0F}, {"mouthPucker", 1.0F}, {"eyeSquintLeft", 1.0F}}}) {
    std::vector<Vertex> once(neutral.size()), again(neutral.size());
    rig::poseByOperator(rig(), weightsByName(rig(), weights), neutral, once);
    again = once;
    const std::vector<Vertex> before = once;
    rig::resolveContacts(rig().contacts, neutral, once);
    prepared.resolve(again);
    EXPECT_EQ(once, again);
    EXPECT_EQ(once == before, weights.empty()) << "contacts move something, and nothing at rest";
  }
}

INSTANTIATE_TEST_SUITE_P(Of, HeadExpressions, ::testing::Values("volto_head", "volto_creature"),
                         [](const auto& which) { return std::string(which.param); });

}  // namespace
}  // namespace volto::retarget
