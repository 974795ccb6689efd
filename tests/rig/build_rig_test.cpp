// From a mesh and its points to a rig: what must hold for every head, on a head known by construction.
#include "rig/build_rig.h"

#include <numeric>
#include <set>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "rig/rig_file.h"
#include "rig/slit_side.h"
#include "tests/rig/test_head.h"

namespace volto::rig {
namespace {

using test::deform;
using test::makeTestHead;
using test::rowOf;
using test::TestHead;

std::size_t id(std::string_view name) { return featurePointIndex(name).value(); }
std::uint32_t vertexOf(const TestHead& head, std::string_view name) {
  return std::get<std::uint32_t>(head.points.at(id(name)));
}
double sumOf(const Rig& rig, std::uint32_t v) {
  const auto row = rowOf(rig, v);
  return std::accumulate(row.begin(), row.end(), 0.0);
}

// Displacement of the points that a turn of the jaw about the ears gives to those of the jaw; skin farther back follows
// the bone less.
FeaturePointPositions jawTurn(const FeaturePointPositions& points, double angle, const Eigen::Vector3d& hinge) {
  FeaturePointPositions d = FeaturePointPositions::Zero();
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX()).toRotationMatrix();
  for (const char* name : {"2.1", "2.10", "2.11", "2.12", "2.13", "2.14", "12.17", "12.18", "2.3", "2.8", "2.9", "8.2",
                           "8.7", "8.8", "12.15", "12.16"}) {
    const auto row = static_cast<Eigen::Index>(id(name));
    const Eigen::Vector3d at = points.row(row);
    const std::string_view name_of = name;
    const double follows = name_of == "2.13" || name_of == "2.14"     ? 0.42
                           : name_of == "12.17" || name_of == "12.18" ? 0.85
                                                                      : 1.0;
    d.row(row) = follows * (turn * (at - hinge) - (at - hinge));
  }
  return d;
}

class PlainHead : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    head_ = new TestHead(makeTestHead());
    rig_ = new Rig(buildRig(head_->mesh, head_->points));
  }
  static void TearDownTestSuite() {
    delete head_;
    delete rig_;
  }
  static TestHead* head_;
  static Rig* rig_;
};
TestHead* PlainHead::head_ = nullptr;
Rig* PlainHead::rig_ = nullptr;

TEST_F(PlainHead, FeaturePointsFollowTheirDisplacementExactly) {
  for (const auto& [p, choice] : head_->points) {
    const std::uint32_t v = std::get<std::uint32_t>(choice);
    ASSERT_EQ(rig_->deformation.row_start[v + 1] - rig_->deformation.row_start[v], 1U) << featurePoints()[p].id;
    EXPECT_EQ(rig_->deformation.point[rig_->deformation.row_start[v]], p);
    EXPECT_EQ(rig_->deformation.weight[rig_->deformation.row_start[v]], 1.0F);
  }
}

TEST_F(PlainHead, NeutralStaysNeutralExactly) {
  EXPECT_TRUE((deform(*rig_, FeaturePointPositions::Zero()).array() == 0.0).all());
}

TEST_F(PlainHead, AConstantDisplacementMovesTheWholeMaskEqually) {
  for (std::uint32_t v = 0; v < head_->mesh.vertexCount(); ++v)
    if (rig_->association.kind[v] == AssociationKind::ray) {
      EXPECT_NEAR(sumOf(*rig_, v), 1.0, 0.02) << v;
    }
}

TEST_F(PlainHead, NearlyEveryVertexOfTheMaskIsFoundByItsRay) {
  const std::size_t on_mask = head_->skirt[0][1];  // the skirt's vertices come after the mask's
  std::size_t by_ray = 0;
  for (std::size_t v = 0; v < on_mask; ++v) by_ray += rig_->association.kind[v] == AssociationKind::ray ? 1U : 0U;
  EXPECT_GT(static_cast<double>(by_ray), 0.95 * static_cast<double>(on_mask));
}

TEST_F(PlainHead, AVertexInsideAMaskTriangleIsAssociatedWithThatTriangle) {
  // The centre of a triangle that was subdivided twice is the centre of its middle polygon: its three vertices are
  // known.
  std::size_t right = 0, all = 0;
  const std::size_t polygons_per_triangle = 16;
  for (std::size_t t = 0; t < kMaskTriangleCount; ++t)
    for (std::size_t p = t * polygons_per_triangle; p < (t + 1) * polygons_per_triangle; ++p)
      for (std::uint32_t c = head_->mesh.polygon_start[p]; c < head_->mesh.polygon_start[p + 1]; ++c) {
        const std::uint32_t v = head_->mesh.corner_vertices[c];
        // Strictly inside: no other triangle's polygons have the vertex.
        bool inside = true;
        for (std::size_t q = 0; q < kMaskTriangleCount * polygons_per_triangle && inside; ++q)
          if (q / polygons_per_triangle != t)
            for (std::uint32_t d = head_->mesh.polygon_start[q]; d < head_->mesh.polygon_start[q + 1]; ++d)
              inside &= head_->mesh.corner_vertices[d] != v;
        if (!inside) continue;
        ++all;
        right += rig_->association.triangle[v] == static_cast<std::int16_t>(t) ? 1U : 0U;
      }
  ASSERT_GT(all, 500U);
  EXPECT_EQ(right, all);
}

TEST_F(PlainHead, UpperLipAndLidsNeverDependOnTheOppositeSide) {
  std::size_t seen = 0;
  for (std::uint32_t v = 0; v < head_->mesh.vertexCount(); ++v) {
    if (rig_->association.kind[v] != AssociationKind::ray) continue;
    const SlitSide side = slitSideOfTriangle(static_cast<std::size_t>(rig_->association.triangle[v]));
    if (side == SlitSide::none) continue;
    const auto row = rowOf(*rig_, v);
    for (std::size_t p = 0; p < kFeaturePointCount; ++p)
      if (opposite(slitSide(p), side)) {
        EXPECT_EQ(row[p], 0.0) << "vertex " << v << " and point " << featurePoints()[p].id;
      }
    ++seen;
  }
  EXPECT_GT(seen, 200U);
}

TEST_F(PlainHead, TheLipsPartWhenTheJawOpens) {
  FeaturePointPositions open = jawTurn(rig_->feature_positions, 0.3, {0, 0, -70});
  const VertexPositions moved = deform(*rig_, open);
  const double opening = -open(static_cast<Eigen::Index>(id("2.3")), 1);
  for (const std::uint32_t v : head_->upper_mouth) EXPECT_LT(moved.row(v).norm(), 0.01 * opening);
  // Away from the corners, which both lips share, the lower lip goes down with its points.
  double widest = 0;
  for (const std::uint32_t v : head_->lower_mouth) {
    EXPECT_LT(moved(v, 1), 0.01 * opening);
    widest = std::max(widest, -moved(v, 1));
  }
  EXPECT_NEAR(widest, opening, 3.0);
}

TEST_F(PlainHead, RegionBordersDoNotShow) {
  // Along an edge rows may change only as much as it is long against the spacing of the control points around; and
  // across a border between two triangles no faster than within one.
  const VertexPositions& at = head_->mesh.positions;
  double worst = 0, across = 0, within = 0;
  std::size_t across_count = 0, within_count = 0;
  for (std::size_t p = 0; p < head_->mesh.polygonCount(); ++p) {
    for (std::uint32_t c = head_->mesh.polygon_start[p] + 1; c < head_->mesh.polygon_start[p + 1]; ++c) {
      const std::uint32_t a = head_->mesh.corner_vertices[c - 1], b = head_->mesh.corner_vertices[c];
      if (rig_->association.kind[a] != AssociationKind::ray || rig_->association.kind[b] != AssociationKind::ray)
        continue;
      const auto ra = rowOf(*rig_, a), rb = rowOf(*rig_, b);
      double change = 0;
      for (std::size_t i = 0; i < kFeaturePointCount; ++i) change += std::abs(ra[i] - rb[i]);
      double spacing = 1e9;
      for (const std::uint32_t v : {a, b}) {
        const auto& region = rig_->region_of_influence[static_cast<std::size_t>(rig_->association.triangle[v])];
        for (const std::uint8_t i : region)
          for (const std::uint8_t j : region)
            if (i < j)
              spacing = std::min(spacing, (rig_->feature_positions.row(i) - rig_->feature_positions.row(j)).norm());
      }
      const double steepness = change / ((at.row(a) - at.row(b)).norm() / spacing);
      worst = std::max(worst, steepness);
      const bool border = rig_->association.triangle[a] != rig_->association.triangle[b];
      (border ? across : within) += steepness;
      ++(border ? across_count : within_count);
    }
  }
  ASSERT_GT(across_count, 500U);
  ASSERT_GT(within_count, 500U);
  across /= static_cast<double>(across_count);
  within /= static_cast<double>(within_count);
  RecordProperty("worst", std::to_string(worst));
  EXPECT_LT(across, 1.3 * within);
  EXPECT_LT(worst, 8 * within) << "on average " << within;
}

TEST_F(PlainHead, ALinearFieldIsFollowedClosely) {
  // A stretch and shear of the whole face, read at the points; the skin between them should do the same.
  Eigen::Matrix3d field;
  field << 0.05, 0.02, 0.0, -0.03, 0.08, 0.01, 0.0, 0.02, -0.04;
  const FeaturePointPositions d = rig_->feature_positions * field.transpose();
  const VertexPositions moved = deform(*rig_, d);
  double error = 0, motion = 0;
  for (std::uint32_t v = 0; v < head_->skirt[0][1]; ++v) {
    const Eigen::Vector3d truth = field * head_->mesh.positions.row(v).transpose();
    error += (moved.row(v).transpose() - truth).squaredNorm();
    motion += truth.squaredNorm();
  }
  EXPECT_LT(std::sqrt(error / motion), 0.03);
}

TEST_F(PlainHead, MotionFadesOutSmoothlyBeyondTheOutline) {
  for (const auto& strip : head_->skirt) {
    std::vector<double> sum;
    for (const std::uint32_t v : strip) sum.push_back(sumOf(*rig_, v));
    EXPECT_NEAR(sum.front(), 1.0, 0.02);
    EXPECT_EQ(sum.back(), 0.0) << "the far end of the neck stays";
    for (std::size_t i = 1; i < sum.size(); ++i) {
      EXPECT_LT(sum[i], sum[i - 1] + 0.02) << "never grows outward";
      EXPECT_GT(sum[i], -0.02);
      EXPECT_LT(sum[i - 1] - sum[i], 0.30) << "no step";
    }
    EXPECT_GT(sum[1], 0.8) << "the skin beside the mask goes with it";
  }
}

TEST_F(PlainHead, SkinUnderTheChinFollowsTheJawPartly) {
  const VertexPositions moved = deform(*rig_, jawTurn(rig_->feature_positions, 0.3, {0, 0, -70}));
  const std::uint32_t chin = vertexOf(*head_, "2.1");
  const auto under =
      std::find_if(head_->skirt.begin(), head_->skirt.end(), [&](const auto& strip) { return strip[0] == chin; });
  ASSERT_NE(under, head_->skirt.end());
  const double full = moved.row(chin).norm();
  EXPECT_GT(moved.row((*under)[1]).norm(), 0.7 * full);
  EXPECT_GT(moved.row((*under)[4]).norm(), 0.15 * full);
  EXPECT_LT(moved.row((*under)[4]).norm(), 0.9 * full);
  EXPECT_EQ(moved.row((*under)[16]).norm(), 0.0);
}

TEST_F(PlainHead, BothSidesAreMirrorImages) {
  std::map<std::array<long, 3>, std::uint32_t> place;
  const auto key = [&](std::uint32_t v, double sign) {
    const auto p = head_->mesh.positions.row(v);
    return std::array<long, 3>{std::lround(sign * p.x() * 1e4), std::lround(p.y() * 1e4), std::lround(p.z() * 1e4)};
  };
  for (std::uint32_t v = 0; v < head_->mesh.vertexCount(); ++v) place[key(v, 1)] = v;
  std::size_t pairs = 0;
  for (std::uint32_t v = 0; v < head_->mesh.vertexCount(); ++v) {
    const auto twin = place.find(key(v, -1));
    if (twin == place.end()) continue;
    ++pairs;
    const auto left = rowOf(*rig_, v), right = rowOf(*rig_, twin->second);
    for (std::size_t p = 0; p < kFeaturePointCount; ++p)
      ASSERT_NEAR(left[p], right[featurePoints()[p].mirror], 5e-3) << v;
  }
  EXPECT_GT(pairs, head_->mesh.vertexCount() * 9 / 10);
}

TEST_F(PlainHead, RowsAreCompactSortedAndFinite) {
  const DeformationOperator& op = rig_->deformation;
  ASSERT_EQ(op.vertexCount(), head_->mesh.vertexCount());
  std::size_t moving = 0;
  for (std::size_t v = 0; v < op.vertexCount(); ++v) {
    moving += op.row_start[v + 1] > op.row_start[v] ? 1U : 0U;
    for (std::uint32_t i = op.row_start[v]; i < op.row_start[v + 1]; ++i) {
      ASSERT_TRUE(std::isfinite(op.weight[i]));
      ASSERT_NE(op.weight[i], 0.0F);
      if (i > op.row_start[v]) {
        ASSERT_LT(op.point[i - 1], op.point[i]);
      }
    }
  }
  EXPECT_LT(static_cast<double>(op.weight.size()) / static_cast<double>(moving), 24.0);
}

TEST_F(PlainHead, TheSameMeshGivesTheSameBytes) {
  EXPECT_EQ(encodeRig(buildRig(head_->mesh, head_->points)), encodeRig(*rig_));
}

TEST_F(PlainHead, SizePlaceAndAttitudeDoNotMatter) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  Mesh other = head_->mesh;
  other.positions = ((0.01 * head_->mesh.positions) * turn.transpose()).rowwise() + Eigen::RowVector3d(50, -20, 7);
  const Rig rig = buildRig(other, head_->points);
  // A vertex in a fold may go to either side of it, as rounding has it; the rows on both sides are much the same.
  std::size_t differ = 0;
  for (std::uint32_t v = 0; v < other.vertexCount(); ++v) {
    const auto a = rowOf(*rig_, v), b = rowOf(rig, v);
    double most = 0;
    for (std::size_t p = 0; p < kFeaturePointCount; ++p) most = std::max(most, std::abs(a[p] - b[p]));
    ASSERT_LT(most, 0.2) << v;
    differ += most > 0.02 ? 1U : 0U;
  }
  EXPECT_LT(differ, other.vertexCount() / 25);
  EXPECT_NEAR(rig.fapu.fapu.mouth_width, 0.01 * rig_->fapu.fapu.mouth_width, 0.01 * rig_->fapu.fapu.mouth_width * 0.02);
}

TEST_F(PlainHead, PolygonsTheOtherWayRoundGiveTheSameRig) {
  Mesh other = head_->mesh;
  for (std::size_t p = 0; p < other.polygonCount(); ++p)
    std::reverse(other.corner_vertices.begin() + other.polygon_start[p],
                 other.corner_vertices.begin() + other.polygon_start[p + 1]);
  const Rig rig = buildRig(other, head_->points);
  EXPECT_EQ(rig.association.triangle, rig_->association.triangle);
}

TEST_F(PlainHead, FreePositionsWorkLikeVertices) {
  FeaturePointChoices free = head_->points;
  // The middle of a face beside the point, so that no vertex is there; every other point stays a vertex.
  const std::size_t p = id("5.1");
  const auto& corners = head_->mesh.corner_vertices;
  const std::uint32_t v = std::get<std::uint32_t>(free[p]);
  const std::size_t corner =
      static_cast<std::size_t>(std::find(corners.begin(), corners.end(), v) - corners.begin()) / 3 * 3;
  const Eigen::Vector3d at =
      (head_->mesh.positions.row(corners[corner]) + head_->mesh.positions.row(corners[corner + 1]) +
       head_->mesh.positions.row(corners[corner + 2])) /
      3;
  free[p] = at;
  const Rig rig = buildRig(head_->mesh, free);
  EXPECT_EQ(rig.feature_vertex[p], -1);
  EXPECT_TRUE(rig.feature_positions.row(static_cast<Eigen::Index>(p)).isApprox(at.transpose()));
  double there = 0;
  for (std::size_t k = 0; k < 3; ++k) there += rowOf(rig, corners[corner + k])[p] / 3;
  EXPECT_NEAR(there, 1.0, 0.01);
}

TEST_F(PlainHead, BlendshapesAreTheTableInThisFacesUnits) {
  ASSERT_EQ(rig_->blendshapes.size(), kArkitBlendshapeCount);
  const std::size_t jaw = arkitBlendshapeIndex("jawOpen").value();
  const Blendshape& open = rig_->blendshapes[jaw];
  EXPECT_EQ(open.name, "jawOpen");
  const std::size_t chin = id("2.1");
  // The reference mask is in the head frame already, so mesh and head axes agree.
  const double down =
      ExpressionTable::standard().basis()(static_cast<Eigen::Index>(3 * chin + 1), static_cast<Eigen::Index>(jaw));
  EXPECT_NEAR(open.mask_displacement[chin][1], down * rig_->fapu.fapu.mouth_nose, 1e-3);
  EXPECT_FALSE(rig_->blendshapes[arkitBlendshapeIndex("tongueOut").value()].moves_mask);
}

// --- heads that are made in other ways

TEST(RigSeams, DoubledVerticesDoNotSplitTheSkin) {
  const TestHead plain = makeTestHead(), split = makeTestHead({.split_midline = true});
  ASSERT_GT(split.mesh.vertexCount(), plain.mesh.vertexCount());
  const Rig a = buildRig(plain.mesh, plain.points), b = buildRig(split.mesh, split.points);
  for (std::uint32_t v = 0; v < split.mesh.vertexCount(); ++v) {
    Eigen::Index original = v;
    if (v >= plain.mesh.vertexCount())
      (plain.mesh.positions.rowwise() - split.mesh.positions.row(v)).rowwise().squaredNorm().minCoeff(&original);
    const auto x = rowOf(a, static_cast<std::uint32_t>(original)), y = rowOf(b, v);
    for (std::size_t p = 0; p < kFeaturePointCount; ++p) ASSERT_NEAR(x[p], y[p], 1e-6) << v;
  }
}

TEST(RigSeams, ClosedLipsThatTouchStayApart) {
  const TestHead head = makeTestHead({.closed_lips = true});
  const Rig rig = buildRig(head.mesh, head.points);
  FeaturePointPositions open = FeaturePointPositions::Zero();
  for (const char* name : {"2.3", "2.8", "2.9", "8.2", "8.7", "8.8"})
    open(static_cast<Eigen::Index>(id(name)), 1) = -10;
  const VertexPositions moved = deform(rig, open);
  for (const std::uint32_t v : head.upper_mouth) EXPECT_NEAR(moved.row(v).norm(), 0.0, 1e-5);
  EXPECT_NEAR(moved(vertexOf(head, "2.3"), 1), -10, 1e-5);
  double total = 0;
  for (const std::uint32_t v : head.lower_mouth) total += moved(v, 1);
  EXPECT_LT(total / static_cast<double>(head.lower_mouth.size()), -5);
}

TEST(RigSeams, OddElementsDoNotDisturb) {
  TestHead head = makeTestHead();
  Mesh& mesh = head.mesh;
  const Rig plain = buildRig(mesh, head.points);
  const auto polygon = [&](std::initializer_list<std::uint32_t> corners) {
    mesh.corner_vertices.insert(mesh.corner_vertices.end(), corners);
    mesh.polygon_start.push_back(static_cast<std::uint32_t>(mesh.corner_vertices.size()));
  };
  polygon({5, 5, 5});
  polygon({mesh.corner_vertices[0], mesh.corner_vertices[1], mesh.corner_vertices[2]});
  const auto unused = static_cast<std::uint32_t>(mesh.vertexCount());
  mesh.positions.conservativeResize(mesh.positions.rows() + 1, 3);
  mesh.positions.row(unused) << 1000, 1000, 1000;
  const Rig rig = buildRig(mesh, head.points);
  EXPECT_EQ(rig.deformation.row_start[unused + 1], rig.deformation.row_start[unused]);
  for (std::uint32_t v = 0; v < unused; ++v) {
    const auto x = rowOf(plain, v), y = rowOf(rig, v);
    for (std::size_t p = 0; p < kFeaturePointCount; ++p) ASSERT_NEAR(x[p], y[p], 0.05) << v;
  }
}

class HeadWithParts : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    head_ = new TestHead(makeTestHead({.parts = true}));
    rig_ = new Rig(buildRig(head_->mesh, head_->points));
  }
  static void TearDownTestSuite() {
    delete head_;
    delete rig_;
  }
  const RigidPart* partOf(const std::string& name) const {
    for (const RigidPart& part : rig_->rigid_parts)
      if (part.vertices == head_->parts.at(name)) return &part;
    return nullptr;
  }
  static TestHead* head_;
  static Rig* rig_;
};
TestHead* HeadWithParts::head_ = nullptr;
Rig* HeadWithParts::rig_ = nullptr;

TEST_F(HeadWithParts, EyeballsKeepStillAndKnowTheirCentre) {
  for (const auto& [name, follows, sign] : {std::tuple{"left eye", RigidPart::Follows::left_eye, 1},
                                            std::tuple{"right eye", RigidPart::Follows::right_eye, -1}}) {
    const RigidPart* eye = partOf(name);
    ASSERT_NE(eye, nullptr) << name;
    EXPECT_EQ(eye->follows, follows);
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const std::uint32_t v : eye->vertices)
      centre += head_->mesh.positions.row(v).transpose() / static_cast<double>(eye->vertices.size());
    EXPECT_NEAR(eye->centre[0], centre[0], 0.1);
    EXPECT_NEAR(eye->centre[2], centre[2], 0.1);
    EXPECT_GT(sign * eye->centre[0], 20);
    for (const std::uint32_t v : eye->vertices) EXPECT_EQ(rowOf(*rig_, v), (std::array<double, kFeaturePointCount>{}));
  }
}

TEST_F(HeadWithParts, UpperTeethStayAndLowerTeethAndTongueTurnWithTheJaw) {
  const Eigen::Vector3d hinge(0, 0, -70);
  const VertexPositions moved = deform(*rig_, jawTurn(rig_->feature_positions, 0.2, hinge));
  const RigidPart* upper = partOf("upper teeth");
  ASSERT_NE(upper, nullptr);
  EXPECT_EQ(upper->follows, RigidPart::Follows::head);
  for (const std::uint32_t v : upper->vertices) EXPECT_EQ(moved.row(v).norm(), 0.0);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()).toRotationMatrix();
  for (const char* name : {"lower teeth", "tongue"}) {
    const RigidPart* part = partOf(name);
    ASSERT_NE(part, nullptr) << name;
    EXPECT_EQ(part->follows, RigidPart::Follows::jaw);
    for (const std::uint32_t v : part->vertices) {
      const Eigen::Vector3d at = head_->mesh.positions.row(v).transpose() - hinge;
      EXPECT_LT((moved.row(v).transpose() - (turn * at - at)).norm(), 0.12 * (turn * at - at).norm()) << name;
    }
  }
}

TEST_F(HeadWithParts, LashesGoWithTheirOwnLidAsAWhole) {
  FeaturePointPositions blink = FeaturePointPositions::Zero();
  for (const char* name : {"12.5", "3.1", "12.6"}) blink(static_cast<Eigen::Index>(id(name)), 1) = -8;
  const VertexPositions moved = deform(*rig_, blink);
  const auto& upper = head_->parts.at("left upper lash");
  // Roots and tips were made in pairs, point by point of the lid margin; the middle three move.
  for (std::size_t i = 1; i < 4; ++i)
    for (std::size_t k = 0; k < 2; ++k) EXPECT_NEAR(moved(upper[2 * i + k], 1), -8, 0.8) << i;
  for (const std::uint32_t v : head_->parts.at("left lower lash")) EXPECT_NEAR(moved.row(v).norm(), 0.0, 0.05);
}

TEST_F(HeadWithParts, HairFarFromTheFaceStays) {
  const RigidPart* hair = partOf("hair");
  ASSERT_NE(hair, nullptr);
  EXPECT_EQ(hair->follows, RigidPart::Follows::head);
  for (const std::uint32_t v : hair->vertices) EXPECT_EQ(sumOf(*rig_, v), 0.0);
}

TEST_F(HeadWithParts, EveryVertexOfAPartIsMarkedAsOne) {
  std::size_t marked = 0;
  for (const AssociationKind kind : rig_->association.kind) marked += kind == AssociationKind::rigid_part ? 1U : 0U;
  std::size_t made = 0;
  for (const auto& [name, vertices] : head_->parts) made += vertices.size();
  EXPECT_EQ(marked, made);
}

// --- bad input

class BadPoints : public testing::Test {
 protected:
  std::string refused(const Mesh& mesh, const FeaturePointChoices& points) {
    try {
      buildRig(mesh, points);
    } catch (const InputError& e) {
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
      return e.what();
    }
    ADD_FAILURE() << "accepted";
    return {};
  }
  TestHead head_ = makeTestHead({.subdivisions = 1});
};

TEST_F(BadPoints, MissingOnesAreNamed) {
  head_.points.erase(id("3.13"));
  head_.points.erase(id("12.20"));
  EXPECT_EQ(refused(head_.mesh, head_.points),
            "2 of 84 feature points are missing: 3.13 12.20; give each a vertex or a position");
  EXPECT_NE(refused(head_.mesh, {}).find("84 of 84"), std::string::npos);
}

TEST_F(BadPoints, OutOfRangeRepeatedAndNotFiniteOnesAreNamed) {
  auto points = head_.points;
  points[id("8.3")] = std::uint32_t{999'999};
  EXPECT_NE(refused(head_.mesh, points).find("8.3 is vertex 999999"), std::string::npos);
  points[id("8.3")] = points[id("2.4")];
  EXPECT_NE(refused(head_.mesh, points).find("2.4 and 8.3 are the same vertex"), std::string::npos);
  points[id("8.3")] = Eigen::Vector3d(0, std::nan(""), 0);
  EXPECT_NE(refused(head_.mesh, points).find("8.3"), std::string::npos);
  points[id("8.3")] = Eigen::Vector3d(head_.mesh.positions.row(vertexOf(head_, "2.4")));
  EXPECT_NE(refused(head_.mesh, points).find("2.4 and 8.3 are in the same place"), std::string::npos);
}

TEST_F(BadPoints, AllInOnePlaceOrOnOneLineIsRefused) {
  FeaturePointChoices points;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) points[p] = Eigen::Vector3d(1, 2, 3);
  EXPECT_EQ(refused(head_.mesh, points), "all feature points are in one place");
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) points[p] = Eigen::Vector3d(static_cast<double>(p), 0, 0);
  EXPECT_NE(refused(head_.mesh, points), "");
}

TEST_F(BadPoints, EyesInOnePlaceAreRefused) {
  auto points = head_.points;
  int k = 0;
  for (const char* name : {"3.7", "3.8", "3.11", "3.12"}) points[id(name)] = Eigen::Vector3d(1e-6 * k++, 0, 30);
  EXPECT_NE(refused(head_.mesh, points).find("eye"), std::string::npos);
}

TEST_F(BadPoints, AMeshThatIsNoneIsRefused) {
  Mesh mesh = head_.mesh;
  mesh.positions(7, 1) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refused(mesh, head_.points), "vertex 7 of the mesh has a position that is not finite");
  mesh = head_.mesh;
  mesh.corner_vertices[4] = 1'000'000;
  EXPECT_NE(refused(mesh, head_.points).find("names vertex 1000000"), std::string::npos);
  mesh = head_.mesh;
  mesh.polygon_start = {0};
  EXPECT_NE(refused(mesh, head_.points).find("no faces"), std::string::npos);
  EXPECT_NE(refused(Mesh{}, head_.points), "");
}

TEST_F(BadPoints, OptionsOutOfRangeAreRefused) {
  for (const auto& [fade, blend] : {std::pair{std::nan(""), 0.5}, std::pair{100.0, 0.5}, std::pair{1.2, -1.0}}) {
    RigOptions options;
    options.fade_out_es = fade;
    options.blend_width = blend;
    EXPECT_THROW(buildRig(head_.mesh, head_.points, options), InputError);
  }
}

}  // namespace
}  // namespace volto::rig
