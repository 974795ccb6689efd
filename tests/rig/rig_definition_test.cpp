// What a person decided about a rig, kept in a file.
#include "rig/rig_definition.h"

#include <gtest/gtest.h>

#include "rig/rig_health.h"
#include "tests/rig/test_head.h"

namespace volto::rig {
namespace {

using test::makeTestHead;
using test::rowOf;
using test::TestHead;

std::size_t id(std::string_view name) { return featurePointIndex(name).value(); }

std::string refused(const std::string& json) {
  try {
    parseRigDefinition(json, "R.json");
  } catch (const InputError& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    return e.what();
  }
  ADD_FAILURE() << "accepted: " << json;
  return {};
}

constexpr const char* kEverything = R"({
  "feature_points": {"2.1": 4711, "3.7": [1, 2.5, -3]},
  "fade_out": 0.9,
  "blend_width": 0.25,
  "labels": {"5.1": "left cheek"},
  "regions": [
    {"triangle": 3, "add": [17], "remove": [4, 5], "stiffness": 1.5},
    {"region": "chin", "stiffness": 2}
  ],
  "parts": [{"vertex": 8123, "follows": "jaw", "name": "lower denture"}],
  "subdivision": {"levels": 2, "triangles": [7]}
})";

TEST(RigDefinition, SaysWhatIsWritten) {
  const RigDefinition d = parseRigDefinition(kEverything, "R.json");
  EXPECT_EQ(std::get<std::uint32_t>(d.points.at(id("2.1"))), 4711U);
  EXPECT_EQ(std::get<Eigen::Vector3d>(d.points.at(id("3.7"))), Eigen::Vector3d(1, 2.5, -3));
  EXPECT_EQ(d.fade_out_es, 0.9);
  EXPECT_EQ(d.edits.labels.at(static_cast<std::uint8_t>(id("5.1"))), FaceRegion::left_cheek);
  EXPECT_EQ(d.edits.neighbourhoods.at(3).remove, (std::vector<std::uint8_t>{4, 5}));
  EXPECT_EQ(d.edits.stiffness.at(3), 1.5);
  EXPECT_GT(d.edits.stiffness.size(), 2U) << "all triangles of the chin";
  EXPECT_EQ(d.parts.at(0), (PartEdit{8123, RigidPartFollows::jaw, "lower denture"}));
  EXPECT_EQ(d.subdivision.levels, 2);
  EXPECT_EQ(d.subdivision.triangles, std::vector<std::uint8_t>{7});
}

TEST(RigDefinition, WrittenAndReadAgainIsTheSame) {
  const RigDefinition d = parseRigDefinition(kEverything, "R.json");
  const std::string text = formatRigDefinition(d);
  const RigDefinition again = parseRigDefinition(text, "R.json");
  EXPECT_EQ(again.points, d.points);
  EXPECT_EQ(again.edits, d.edits);
  EXPECT_EQ(again.parts, d.parts);
  EXPECT_EQ(again.subdivision, d.subdivision);
  EXPECT_EQ(again.fade_out_es, d.fade_out_es);
  EXPECT_EQ(formatRigDefinition(again), text);
}

TEST(RigDefinition, ATriangleIsNamedByItsPointsInAnyOrder) {
  const MaskTriangle& t = maskTriangles()[40];
  const auto name = [&](int i) {
    return "\"" + std::string(featurePoints()[t[static_cast<std::size_t>(i)]].id) + "\"";
  };
  const std::string json =
      "{\"subdivision\": {\"levels\": 1, \"triangles\": [[" + name(2) + "," + name(0) + "," + name(1) + "]]}}";
  EXPECT_EQ(parseRigDefinition(json, "R.json").subdivision.triangles, std::vector<std::uint8_t>{40});
}

TEST(RigDefinition, UnknownNamesGetASuggestion) {
  EXPECT_EQ(refused(R"({"fade_ot": 1})"), "R.json: unknown key \"fade_ot\"; did you mean \"fade_out\"?");
  EXPECT_EQ(refused(R"({"regions": [{"triangle": 1, "stifness": 2}]})"),
            "R.json: regions[0]: unknown key \"stifness\"; did you mean \"stiffness\"?");
  EXPECT_NE(refused(R"({"labels": {"5.1": "left chek"}})").find("did you mean \"left cheek\"?"), std::string::npos);
  EXPECT_NE(refused(R"({"labels": {"99.1": "nose"}})").find("unknown feature point \"99.1\""), std::string::npos);
  EXPECT_NE(refused(R"({"parts": [{"vertex": 1, "follows": "jar"}]})").find("did you mean \"jaw\"?"),
            std::string::npos);
}

TEST(RigDefinition, BadValuesAreNamedWithTheirPlace) {
  EXPECT_NE(refused(R"({"fade_out": 100})").find("fade_out: must be a number from 0.1 to 5, it is 100"),
            std::string::npos);
  EXPECT_NE(refused(R"({"fade_out": "wide"})").find("fade_out"), std::string::npos);
  EXPECT_NE(
      refused(R"({"regions": [{"triangle": 136}]})").find("regions[0].triangle: must be a whole number from 0 to 135"),
      std::string::npos);
  EXPECT_NE(refused(R"({"regions": [{"triangle": 1, "stiffness": -1}]})").find("regions[0].stiffness"),
            std::string::npos);
  EXPECT_NE(refused(R"({"regions": [{"triangle": ["2.1", "3.1", "9.3"]}]})").find("no triangle"), std::string::npos);
  EXPECT_NE(refused(R"({"regions": [{}]})").find("needs either"), std::string::npos);
  EXPECT_NE(refused(R"({"subdivision": {"levels": 1, "budget": 3}})").find("exactly one"), std::string::npos);
  EXPECT_NE(refused(R"({"subdivision": {"levels": 40}})").find("subdivision.levels"), std::string::npos);
  EXPECT_NE(refused("{\n\"fade_out\": 1,\n}").find("line 3"), std::string::npos);
  EXPECT_NE(refused("[]").find("object"), std::string::npos);
  EXPECT_NE(refused(R"({"feature_points": {"2.1": -4}})").find("2.1"), std::string::npos);
}

TEST(RigDefinition, RemovingANeighbourTakesItsPointsOutOfTheRegion) {
  const TestHead head = makeTestHead({.subdivisions = 1});
  const Rig plain = buildRig(head.mesh, head.points);
  RigOptions options;
  // Every neighbour of triangle 60 removed: its own three points are left.
  for (std::size_t t = 0; t < kMaskTriangleCount; ++t)
    if (t != 60) options.edits.neighbourhoods[60].remove.push_back(static_cast<std::uint8_t>(t));
  options.edits.neighbourhoods[61].add = {0};
  const Rig edited = buildRig(head.mesh, head.points, options);
  EXPECT_EQ(edited.region_of_influence[60].size(), 3U);
  EXPECT_GT(plain.region_of_influence[60].size(), 8U);
  for (const std::uint8_t p : maskTriangles()[0])
    EXPECT_TRUE(std::find(edited.region_of_influence[61].begin(), edited.region_of_influence[61].end(), p) !=
                edited.region_of_influence[61].end());
}

TEST(RigDefinition, PartsFollowWhatAPersonSaid) {
  const TestHead head = makeTestHead({.parts = true});
  RigOptions options;
  options.parts = {{head.parts.at("hair").front(), RigidPartFollows::jaw, "beard"}};
  const Rig rig = buildRig(head.mesh, head.points, options);
  bool found = false;
  for (const RigidPart& part : rig.rigid_parts)
    if (part.name == "beard") {
      found = true;
      EXPECT_EQ(part.follows, RigidPart::Follows::jaw);
      EXPECT_EQ(part.vertices, head.parts.at("hair"));
    }
  EXPECT_TRUE(found);
  double chin = 0;
  for (const double w : rowOf(rig, head.parts.at("hair").front())) chin += std::abs(w);
  EXPECT_GT(chin, 0.5);
  options.parts = {{std::get<std::uint32_t>(head.points.at(0)), RigidPartFollows::jaw, ""}};
  EXPECT_THROW(buildRig(head.mesh, head.points, options), InputError) << "the skin is no part";
}

TEST(RigHealth, AGoodHeadHasNothingToMend) {
  const TestHead head = makeTestHead();
  const RigHealth health = inspectRig(buildRig(head.mesh, head.points));
  EXPECT_TRUE(health.torn.empty());
  EXPECT_TRUE(health.shared_points.empty());
  EXPECT_TRUE(health.empty_regions.empty());
  EXPECT_LT(health.doubtful.size(), head.mesh.vertexCount() / 200);
  EXPECT_TRUE(health.problems.empty()) << health.problems.front();
  EXPECT_LT(health.smoothness.relative(), 0.05);
  for (const RegionHealth& region : health.regions) {
    EXPECT_GT(region.control_points, 3U);
    EXPECT_GT(region.condition, 1);
    EXPECT_LT(region.condition, 1e7);
  }
}

TEST(RigHealth, ATearIsFound) {
  const TestHead head = makeTestHead();
  Rig rig = buildRig(head.mesh, head.points);
  // The row of a vertex in the cheek is lost.
  const std::uint32_t v = std::get<std::uint32_t>(head.points.at(id("5.1")));
  DeformationOperator& op = rig.deformation;
  const std::uint32_t gone = op.row_start[v + 1] - op.row_start[v];
  op.point.erase(op.point.begin() + op.row_start[v], op.point.begin() + op.row_start[v + 1]);
  op.weight.erase(op.weight.begin() + op.row_start[v], op.weight.begin() + op.row_start[v + 1]);
  for (std::size_t r = v + 1; r < op.row_start.size(); ++r) op.row_start[r] -= gone;
  const RigHealth health = inspectRig(rig);
  EXPECT_EQ(health.torn, std::vector<std::uint32_t>{v});
  ASSERT_FALSE(health.problems.empty());
  EXPECT_NE(health.problems.front().find("tear"), std::string::npos);
}

TEST(RigHealth, AJumpAtBordersIsMeasured) {
  // A field that is linear has no jump; one that steps from triangle to triangle has.
  const TestHead head = makeTestHead();
  const Rig rig = buildRig(head.mesh, head.points);
  Eigen::Matrix3d linear;
  linear << 0.05, 0.02, 0.0, -0.03, 0.08, 0.01, 0.0, 0.02, -0.04;
  const VertexPositions smooth = head.mesh.positions * linear.transpose();
  EXPECT_LT(borderJump(head.mesh, rig.association.triangle, smooth).relative(), 0.03);
  VertexPositions steps = smooth;
  for (Eigen::Index v = 0; v < steps.rows(); ++v)
    steps.row(v).array() += rig.association.triangle[static_cast<std::size_t>(v)] % 2 == 0 ? 1.0 : 0.0;
  const BorderJump jump = borderJump(head.mesh, rig.association.triangle, steps);
  EXPECT_GT(jump.edges, 300U);
  EXPECT_GT(jump.jump, 0.5);
}

}  // namespace
}  // namespace volto::rig
