// The head as a face: its feature points where a face has them, human proportions, eyes behind lids, lips that can
// part.
#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "rig/assets/head/head_mesh.h"
#include "rig/assets/head/skin_field.h"
#include "rig/fapu.h"
#include "rig/feature_points.h"

namespace volto::head {
namespace {

class HeadForm : public ::testing::TestWithParam<bool> {
 protected:
  static const Head& head() {
    static const Head made[] = {makeHead(adult()), makeHead(creature())};
    return made[GetParam() ? 1 : 0];
  }
  static Vec3 eye() { return eyeCentre(head().character.proportions); }
  static double radius() { return eyeRadius(head().character.proportions); }
  static double eyeSize() { return head().character.proportions.eye_size; }
  static int vertexOf(std::string_view id) {
    for (const auto& [name, v] : head().feature_points)
      if (name == id) return v;
    ADD_FAILURE() << "no feature point " << id;
    return 0;
  }
  static Vec3 point(std::string_view id) { return head().vertices[static_cast<std::size_t>(vertexOf(id))]; }
  static rig::FapuMeasurement fapu() {
    rig::FeaturePointPositions positions;
    for (std::size_t i = 0; i < rig::featurePoints().size(); ++i) {
      const Vec3 p = point(rig::featurePoints()[i].id);
      positions.row(static_cast<Eigen::Index>(i)) << p.x, p.y, p.z;
    }
    return rig::measureFapu(positions);
  }
  static std::set<int> verticesOf(Material material) {
    std::set<int> out;
    for (const Polygon& polygon : head().polygons)
      if (polygon.material == material) out.insert(polygon.corners.begin(), polygon.corners.end());
    return out;
  }
};

TEST_P(HeadForm, All84PointsAreSkinVerticesAndMirrorPairs) {
  ASSERT_EQ(head().feature_points.size(), rig::featurePoints().size());
  std::set<int> distinct;
  for (std::size_t i = 0; i < rig::featurePoints().size(); ++i) {
    const rig::FeaturePoint& p = rig::featurePoints()[i];
    const auto& [id, v] = head().feature_points[i];
    EXPECT_EQ(id, p.id);
    EXPECT_LT(v, head().components[0].vertex_count) << id << " is not on the skin";
    distinct.insert(v);
    EXPECT_EQ(head().mirror[static_cast<std::size_t>(v)], head().feature_points[p.mirror].second) << id;
  }
  EXPECT_EQ(distinct.size(), rig::featurePoints().size());
}

TEST_P(HeadForm, PointsStandInTheOrderOfAFace) {
  const char* down[] = {"11.1", "12.13", "12.14", "9.12", "9.3", "9.15", "8.1", "2.2", "2.3", "8.2", "2.10", "2.1"};
  for (std::size_t i = 0; i + 1 < std::size(down); ++i) {
    EXPECT_GT(point(down[i]).y, point(down[i + 1]).y) << down[i] << " above " << down[i + 1];
    EXPECT_EQ(point(down[i]).x, 0) << down[i];
  }
  const char* upward[] = {"5.1", "5.3", "3.9", "3.3", "3.1", "3.13", "4.3"};
  for (std::size_t i = 0; i + 1 < std::size(upward); ++i)
    EXPECT_LT(point(upward[i]).y, point(upward[i + 1]).y) << upward[i] << " below " << upward[i + 1];
  const char* outward[] = {"3.11", "12.5", "3.1", "12.6", "3.7"};
  for (std::size_t i = 0; i + 1 < std::size(outward); ++i)
    EXPECT_LT(point(outward[i]).x, point(outward[i + 1]).x) << outward[i] << " within " << outward[i + 1];
  const char* jaw[] = {"2.1", "2.11", "12.17", "2.13", "12.19", "10.7", "10.9"};  // left: up and back along the jaw
  for (std::size_t i = 0; i + 1 < std::size(jaw); ++i) {
    EXPECT_LT(point(jaw[i]).y, point(jaw[i + 1]).y) << jaw[i] << " below " << jaw[i + 1];
    EXPECT_LT(point(jaw[i]).x, point(jaw[i + 1]).x) << jaw[i] << " within " << jaw[i + 1];
  }
  for (const rig::FeaturePoint& p : rig::featurePoints())  // the tip of the nose is foremost
    EXPECT_LE(point(p.id).z, point("9.3").z) << p.id;
}

// Adult averages (Farkas): pupils 6.2 cm apart, nose 5.1, upper lip 2.1, mouth 5.1, opening of the lids 1.1; a tenth
// and more either way.
TEST_P(HeadForm, AdultsProportionsAreHuman) {
  if (GetParam()) GTEST_SKIP() << "the creature's are not";
  const rig::FapuMeasurement m = fapu();
  EXPECT_TRUE(m.substitutions.empty());
  EXPECT_NEAR(m.fapu.eye_separation, 6.2, 0.4);
  EXPECT_NEAR(m.fapu.iris_diameter, 1.08, 0.15);
  EXPECT_NEAR(m.fapu.eye_nose, 4.5, 0.5);
  EXPECT_NEAR(m.fapu.mouth_nose, 2.1, 0.3);
  EXPECT_NEAR(m.fapu.mouth_width, 5.1, 0.4);
  EXPECT_NEAR(length(point("12.13") - point("2.1")), 11.8, 1.2);  // face height
  EXPECT_NEAR(point("9.1").x - point("9.2").x, 3.4, 0.5);         // nose width
  double low = 0, high = 0, wide = 0, back = 0;
  for (const int v : verticesOf(Material::hair)) {
    const Vec3& p = head().vertices[static_cast<std::size_t>(v)];
    high = std::max(high, p.y);
    wide = std::max(wide, p.x);
    back = std::min(back, p.z);
  }
  low = point("2.1").y;
  EXPECT_NEAR(high - low, 22.7, 1.5);  // head height
  EXPECT_NEAR(2 * wide, 15.3, 1.0);    // head breadth
  EXPECT_NEAR(9.6 - back, 19.2, 1.2);  // head length from the glabella
}

TEST_P(HeadForm, CreatureHasBigEyesAWideMouthAndPointedEars) {
  if (!GetParam()) GTEST_SKIP() << "compared with the adult";
  const Head human = makeHead(adult());
  const auto of = [&](const Head& h, std::string_view id) {
    return h.vertices[static_cast<std::size_t>(vertexOf(id))];  // the same vertices in both
  };
  const auto ratio = [&](std::string_view a, std::string_view b) {
    return length(of(head(), a) - of(head(), b)) / length(of(human, a) - of(human, b));
  };
  EXPECT_EQ(human.feature_points, head().feature_points);
  EXPECT_GT(ratio("3.7", "3.11"), 1.5);    // eye, corner to corner
  EXPECT_GT(ratio("3.1", "3.3"), 1.7);     // opening of the lids
  EXPECT_GT(ratio("8.3", "8.4"), 1.2);     // mouth
  EXPECT_GT(ratio("9.1", "9.2"), 1.15);    // nose
  EXPECT_LT(ratio("9.3", "9.15"), 1.0);    // tip of the nose over its base
  EXPECT_LT(ratio("2.11", "2.12"), 0.85);  // chin, across
  const auto chin = [&](const Head& h) { return of(h, "8.2").y - of(h, "2.1").y; };
  EXPECT_LT(chin(head()), 0.8 * chin(human));
  Vec3 tip, human_tip;  // furthest out
  for (std::size_t v = 0; v < head().vertices.size(); ++v) {
    if (head().vertices[v].x > tip.x) tip = head().vertices[v];
    if (human.vertices[v].x > human_tip.x) human_tip = human.vertices[v];
  }
  EXPECT_GT(tip.x, human_tip.x + 4);
  EXPECT_GT(tip.y, human_tip.y + 2);
}

TEST_P(HeadForm, LidsLieOnTheEyeballAndNothingOfTheSkinIsInsideIt) {
  for (const char* id : {"3.1", "3.3", "12.5", "12.6", "12.7", "12.8"}) {
    const double away = length(point(id) - eye()) - radius();
    EXPECT_GT(away, 0.0) << id;
    EXPECT_LT(away, (0.35 + head().character.proportions.lid_thickness) * eyeSize()) << id;
  }
  double nearest = 1;
  for (int v = 0; v < head().components[0].vertex_count; ++v)
    nearest = std::min(nearest, length(head().vertices[static_cast<std::size_t>(v)] - eye()) - radius());
  EXPECT_GT(nearest, 0.01 * eyeSize());
  EXPECT_LT(nearest, 0.05 * eyeSize()) << "the back of the lid margin should nearly touch the eyeball";
  for (const Material m : {Material::iris, Material::pupil, Material::eye_white})
    for (const int v : verticesOf(m)) {
      const Vec3& p = head().vertices[static_cast<std::size_t>(v)];
      EXPECT_NEAR(length({std::fabs(p.x) - eye().x, p.y - eye().y, p.z - eye().z}), radius(), 1e-9);
    }
}

TEST_P(HeadForm, LipsTouchWithoutBeingJoined) {
  for (const auto& [upper, lower] : {std::pair{"2.2", "2.3"}, {"2.6", "2.8"}, {"2.7", "2.9"}}) {
    EXPECT_NE(vertexOf(upper), vertexOf(lower));
    const double gap = point(upper).y - point(lower).y;
    EXPECT_GT(gap, 0.001) << upper;
    EXPECT_LT(gap, 0.05) << upper;
  }
  // No vertex of the upper lip below the line where the lips meet, none of the lower lip above it.
  for (const int v : verticesOf(Material::lips)) {
    const Vec3& p = head().vertices[static_cast<std::size_t>(v)];
    EXPECT_GT(p.y, -8.0);
    EXPECT_LT(p.y, -5.5);
  }
}

TEST_P(HeadForm, TeethAndTongueStandBehindTheClosedLips) {
  const double lips = std::min(point("2.2").z, point("2.3").z);
  for (const Material m : {Material::teeth, Material::tongue, Material::gums})
    for (const int v : verticesOf(m)) ASSERT_LT(head().vertices[static_cast<std::size_t>(v)].z, lips - 0.3);
}

INSTANTIATE_TEST_SUITE_P(Of, HeadForm, ::testing::Bool(),
                         [](const auto& which) { return which.param ? "Creature" : "Adult"; });

}  // namespace
}  // namespace volto::head
