// A face found on a mesh told nothing, and what is no face refused.
#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "rig/finding/find_face.h"
#include "rig/head_frame.h"
#include "rig/mesh_io.h"
#include "rig/skin.h"
#include "tests/rig/finding_shapes.h"
#include "tests/rig/fitting_support.h"
#include "tests/support/test_data.h"

namespace volto::rig {
namespace {

std::filesystem::path asset(const char* name) { return volto::test::sourceDir() / "rig/assets" / name; }

const test::KnownHead& adult() {
  static const test::KnownHead head = test::KnownHead::read(asset("volto_head.obj"), asset("volto_head.points.json"));
  return head;
}

struct FindingError {
  double rotation_deg = 0;  // from the rotation that all 84 true points tell
  double scale = 0;         // of the eye separation, relative
  double mean = 0;          // distance of the landmarks from the truth, eye separations
  double worst = 0;
};

FindingError errorOf(const FoundFace& face, const test::KnownHead& head) {
  FeaturePointPositions truth;
  for (std::size_t i = 0; i < kFeaturePointCount; ++i)
    truth.row(static_cast<Eigen::Index>(i)) = head.at(featurePoints()[i].id);
  FindingError error;
  const Eigen::Matrix3d between = face.mesh_from_head.transpose() * meshFromHead(truth);
  error.rotation_deg = Eigen::AngleAxisd(between).angle() * 180 / std::numbers::pi;
  const double eye_separation = head.eyeSeparation();
  error.scale = std::abs(face.eye_separation / eye_separation - 1);
  for (const RoughLandmark& landmark : face.landmarks) {
    const double distance =
        (landmark.position - truth.row(static_cast<Eigen::Index>(landmark.feature_point)).transpose()).norm() /
        eye_separation;
    error.mean += distance / static_cast<double>(face.landmarks.size());
    error.worst = std::max(error.worst, distance);
  }
  return error;
}

std::string refusalOf(const Mesh& mesh, const FindOptions& options = {}) {
  try {
    const FoundFace face = findFace(mesh, options);
    return "found a face with confidence " + std::to_string(face.confidence);
  } catch (const InputError& error) {
    return error.what();
  }
}

std::vector<std::uint32_t> everyPolygon(const Mesh& mesh, std::uint32_t step) {
  std::vector<std::uint32_t> polygons;
  for (std::uint32_t p = 0; p < mesh.polygonCount(); p += step) polygons.push_back(p);
  return polygons;
}

// The median of the times would hide a slow turn: all are shown.
void show(const char* what, unsigned seed, const FindingError& error, const FoundFace& face, double seconds) {
  std::printf(
      "%s placed %u: rotation %.1f degrees, scale %.1f %%, landmarks mean %.1f %% worst %.1f %%, confidence %.3f, %.2f "
      "s\n",
      what, seed, error.rotation_deg, 100 * error.scale, 100 * error.mean, 100 * error.worst, face.confidence, seconds);
}

struct Head {
  const char* mesh;
  const char* points;
  double mean;  // landmarks, eye separations
};

void expectFound(const Head& head, const test::KnownHead& known, unsigned placements) {
  for (unsigned seed = 0; seed < placements; ++seed) {
    const test::KnownHead placed = known.placedAnyhow(seed);
    const auto start = std::chrono::steady_clock::now();
    const FoundFace face = findFace(placed.mesh);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const FindingError error = errorOf(face, placed);
    show(head.mesh, seed, error, face, seconds);
    EXPECT_LT(error.rotation_deg, 10) << "seed " << seed;
    EXPECT_LT(error.scale, 0.12) << "seed " << seed;
    EXPECT_LT(error.mean, head.mean) << "seed " << seed;
    EXPECT_LT(error.worst, 0.4) << "seed " << seed;
    EXPECT_GT(face.confidence, 0.8) << "seed " << seed;
    EXPECT_FALSE(face.inside_out) << "seed " << seed;
    EXPECT_NEAR((face.mesh_from_head.transpose() * face.mesh_from_head - Eigen::Matrix3d::Identity()).norm(), 0, 1e-9);
    EXPECT_NEAR(face.mesh_from_head.determinant(), 1, 1e-9);
  }
}

class HeadByOthers : public testing::TestWithParam<Head> {};

TEST_P(HeadByOthers, IsFoundHoweverItLies) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "SKIPPED: measured in the plain build";
#endif
  VOLTO_REQUIRE_DATA(data);
  const test::KnownHead head = test::KnownHead::read(data / "meshes" / GetParam().mesh,
                                                     volto::test::sourceDir() / "tests/rig" / GetParam().points);
  expectFound(GetParam(), head, 3);
}

INSTANTIATE_TEST_SUITE_P(
    , HeadByOthers,
    testing::Values(Head{"ict/person_a.obj", "ict_feature_points.json", 0.06},
                    Head{"ict/person_b.obj", "ict_feature_points.json", 0.06},
                    Head{"makehuman/asian-male-old/neutral.obj", "makehuman_feature_points.json", 0.075},
                    Head{"makehuman/caucasian-female-young/neutral.obj", "makehuman_feature_points.json", 0.05}),
    [](const testing::TestParamInfo<Head>& head) {
      std::string name(head.param.mesh);
      std::replace_if(
          name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
      return name;
    });

test::KnownHead headByOthers(const std::filesystem::path& data, const char* mesh, const char* points) {
  return test::KnownHead::read(data / "meshes" / mesh, volto::test::sourceDir() / "tests/rig" / points);
}

TEST(ShapedByOthers, IsFoundWithItsMouthOpen) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "SKIPPED: measured in the plain build";
#endif
  VOLTO_REQUIRE_DATA(data);
  test::KnownHead head = headByOthers(data, "ict/person_a.obj", "ict_feature_points.json");
  const Mesh neutral = readMesh(data / "meshes/ict/neutral.obj"),
             open = readMesh(data / "meshes/ict/expressions/jawOpen.obj");
  head.mesh.positions += 0.25 * (open.positions - neutral.positions);
  const FoundFace face = findFace(head.mesh);
  const FindingError error = errorOf(face, head);
  show("mouth open", 0, error, face, 0);
  EXPECT_LT(error.rotation_deg, 10);
  EXPECT_LT(error.mean, 0.08);
  EXPECT_GT(face.confidence, 0.7);
}

TEST(ShapedByOthers, WithoutEyeballsHasTheCornersOfItsEyesOnTheLidsAllTheSame) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "SKIPPED: measured in the plain build";
#endif
  VOLTO_REQUIRE_DATA(data);
  test::KnownHead head =
      headByOthers(data, "makehuman/caucasian-female-young/neutral.obj", "makehuman_feature_points.json");
  std::vector<std::uint32_t> same_as(head.mesh.vertexCount());
  std::iota(same_as.begin(), same_as.end(), 0U);
  const Skin skin = prepareSkin(head.mesh, std::move(same_as));
  const auto nose = std::get<std::uint32_t>(head.truth.at(featurePointIndex("9.3").value()));
  test::KnownHead bare = head;
  bare.mesh = test::cropped(head.mesh, [&](std::uint32_t v) { return skin.component[v] == skin.component[nose]; });
  ASSERT_LT(bare.mesh.polygonCount(), head.mesh.polygonCount());
  // Vertices keep their order, not their numbers.
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) bare.truth[p] = head.at(featurePoints()[p].id);
  const FoundFace face = findFace(bare.mesh);
  const FindingError error = errorOf(face, bare);
  show("without eyeballs", 0, error, face, 0);
  EXPECT_LT(error.mean, 0.06);
  EXPECT_LT(error.worst, 0.2);
}

TEST(ShippedHead, IsFoundHoweverItLies) { expectFound({"volto_head.obj", "", 0.11}, adult(), 2); }

TEST(ShippedCreature, IsFoundThoughItIsNoMan) {
  expectFound({"volto_creature.obj", "", 0.14},
              test::KnownHead::read(asset("volto_creature.obj"), asset("volto_creature.points.json")), 1);
}

TEST(Finding, GivesTheSameTwice) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "SKIPPED: the same code as in ShippedHead and Cube, which run under sanitizers too";
#endif
  const FoundFace once = findFace(adult().mesh);
  const FoundFace again = findFace(adult().mesh);
  EXPECT_EQ(once.mesh_from_head, again.mesh_from_head);
  EXPECT_EQ(once.confidence, again.confidence);
  ASSERT_EQ(once.landmarks.size(), again.landmarks.size());
  for (std::size_t i = 0; i < once.landmarks.size(); ++i) {
    EXPECT_EQ(once.landmarks[i].position, again.landmarks[i].position);
    EXPECT_EQ(once.landmarks[i].confidence, again.landmarks[i].confidence);
  }
}

struct Variant {
  const char* name;
  Mesh (*make)();
};
void PrintTo(const Variant& variant, std::ostream* stream) { *stream << variant.name; }
std::string nameOf(const testing::TestParamInfo<Variant>& info) { return info.param.name; }

class AdultWith : public testing::TestWithParam<Variant> {};

TEST_P(AdultWith, IsFound) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "SKIPPED: the same code as in ShippedHead and Cube, which run under sanitizers too";
#endif
  test::KnownHead known{GetParam().make(), {}};
  for (std::size_t i = 0; i < kFeaturePointCount; ++i) known.truth[i] = adult().at(featurePoints()[i].id);
  const FoundFace face = findFace(known.mesh);
  const FindingError error = errorOf(face, known);
  show(GetParam().name, 0, error, face, 0);
  EXPECT_LT(error.rotation_deg, 10);
  EXPECT_LT(error.mean, 0.1);
  EXPECT_GT(face.confidence, 0.8);
}

INSTANTIATE_TEST_SUITE_P(
    , AdultWith,
    testing::Values(
        Variant{"NoiseOfATenthOfItsLidOpening", [] { return test::noisy(adult().mesh, 0.1, 1); }},
        Variant{"EdgesAsLongAsALip", [] { return test::clustered(adult().mesh, 0.9); }},
        Variant{"ABodyTurnedAside",
                [] {
                  const Eigen::Matrix3d turn =
                      Eigen::AngleAxisd(0.5, Eigen::Vector3d(0.2, 1, 0.1).normalized()).toRotationMatrix();
                  return test::together({adult().mesh, test::moved(test::headlessBody(), turn, 6.2, {0, -22, -2})});
                }}),
    nameOf);

class NoFace : public testing::TestWithParam<Variant> {};

TEST_P(NoFace, IsRefusedWithWhatWasLookedForAndNotFound) {
  const std::string refusal = refusalOf(GetParam().make());
  EXPECT_TRUE(refusal.starts_with("looked for a face")) << refusal;
  EXPECT_NE(refusal.find("found no"), std::string::npos) << refusal;
  EXPECT_EQ(refusal.find('\n'), std::string::npos) << refusal;
}

INSTANTIATE_TEST_SUITE_P(, NoFace,
                         testing::Values(Variant{"Nothing", [] { return Mesh{}; }}, Variant{"Cube", test::cube},
                                         Variant{"Sphere", test::sphere}, Variant{"Plane", test::flatPlane},
                                         Variant{"Cylinder", test::cylinder}, Variant{"Hand", test::hand},
                                         Variant{"BodyWithoutHead", test::headlessBody},
                                         Variant{"SymmetricBumps", [] { return test::symmetricBumps(1); }}),
                         nameOf);

TEST(Finding, RefusesAMeshOfOnePoint) {
  Mesh mesh = adult().mesh;
  mesh.positions.setConstant(3);
  EXPECT_NE(refusalOf(mesh).find("no surface"), std::string::npos) << refusalOf(mesh);
}

TEST(Finding, RefusesTwoHeads) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "SKIPPED: the same code as in ShippedHead and Cube, which run under sanitizers too";
#endif
  const Mesh two =
      test::together({adult().mesh, test::moved(adult().mesh, Eigen::Matrix3d::Identity(), 1, {25, 0, 0})});
  EXPECT_NE(refusalOf(two).find("found two"), std::string::npos) << refusalOf(two);
}

TEST(Finding, AnotherFaceThanTheOneThatPointsAreOnIsNoticed) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "SKIPPED: the same code as in ShippedHead and Cube, which run under sanitizers too";
#endif
  FeaturePointPositions points;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p)
    points.row(static_cast<Eigen::Index>(p)) = adult().at(featurePoints()[p].id).transpose();
  EXPECT_FALSE(findAnotherFace(adult().mesh, points).has_value());
  const Mesh two =
      test::together({adult().mesh, test::moved(adult().mesh, Eigen::Matrix3d::Identity(), 1, {25, 0, 0})});
  const std::optional<double> apart = findAnotherFace(two, points);
  ASSERT_TRUE(apart.has_value());
  EXPECT_NEAR(*apart, 25 / adult().eyeSeparation(), 0.5);
  const Mesh with_body = test::together(
      {adult().mesh, test::moved(test::headlessBody(), Eigen::Matrix3d::Identity(), 10, {0, -30, 0})});
  EXPECT_FALSE(findAnotherFace(with_body, points).has_value());
}

TEST(Finding, SaysItsLimitBeforeItStarts) {
  const std::string refusal = refusalOf(adult().mesh, {.max_vertices = 1000, .min_confidence = 0});
  EXPECT_NE(refusal.find("up to 1000"), std::string::npos) << refusal;
}

TEST(Finding, TakesTheBestGuessWhenToldTo) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "SKIPPED: the same code as in ShippedHead and Cube, which run under sanitizers too";
#endif
  const FoundFace face = findFace(test::symmetricBumps(1), {.max_vertices = 100000, .min_confidence = 0});
  EXPECT_LT(face.confidence, 0.35);
  EXPECT_FALSE(face.notes.empty());
}

TEST(Winding, OfAHeadInsideOutIsNamedAndMended) {
  Mesh mesh = adult().mesh;
  reversePolygons(mesh, everyPolygon(mesh, 1));
  const FoundFace face = findFace(mesh);
  EXPECT_TRUE(face.inside_out);
  EXPECT_EQ(face.reversed_polygons.size(), mesh.polygonCount());
  ASSERT_FALSE(face.notes.empty());
  EXPECT_NE(face.notes.front().find("inside out"), std::string::npos);
  reversePolygons(mesh, face.reversed_polygons);
  EXPECT_EQ(mesh.corner_vertices, adult().mesh.corner_vertices);
}

TEST(Winding, OfAMirroredHeadIsNamed) {
  const test::KnownHead mirrored = adult().mirrored();
  const FoundFace face = findFace(mirrored.mesh);
  EXPECT_TRUE(face.inside_out);
  // Up and out of the face are what they were; left is on the other side of the mesh, as a mirror shows it.
  EXPECT_GT(face.mesh_from_head(1, 1), 0.98);
  EXPECT_GT(face.mesh_from_head(2, 2), 0.98);
  EXPECT_GT(face.mesh_from_head(0, 0), 0.98);
}

TEST(Winding, OfSinglePolygonsIsFoundAndMended) {
  Mesh mesh = adult().mesh;
  const std::vector<std::uint32_t> turned = everyPolygon(mesh, 23);
  reversePolygons(mesh, turned);
  const FoundFace face = findFace(mesh);
  EXPECT_FALSE(face.inside_out);
  std::vector<std::uint32_t> found;
  std::set_intersection(face.reversed_polygons.begin(), face.reversed_polygons.end(), turned.begin(), turned.end(),
                        std::back_inserter(found));
  EXPECT_EQ(found.size(), face.reversed_polygons.size()) << "polygons that were right are called reversed";
  EXPECT_GT(found.size(), turned.size() * 9 / 10);
}

TEST(Winding, OfASoundHeadIsLeftAlone) { EXPECT_TRUE(findFace(adult().mesh).reversed_polygons.empty()); }

}  // namespace
}  // namespace volto::rig
