#include "rig/expression_table.h"

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "rig/control_mask.h"
#include "rig/errors.h"
#include "rig/fapu.h"

namespace volto::rig {
namespace {

Eigen::Index row(std::string_view id) { return static_cast<Eigen::Index>(featurePointIndex(id).value()); }
std::size_t shape(std::string_view name) { return arkitBlendshapeIndex(name).value(); }

// The reference face in one expression, millimetres.
FeaturePointPositions face(std::string_view name, float weight = 1) {
  ArkitWeights weights{};
  weights[shape(name)] = weight;
  MaskDisplacements displaced{};
  ExpressionTable::standard().apply(weights, displaced);
  const FeaturePointPositions scale = fapuScale(measureFapu(referenceMask()).fapu);
  FeaturePointPositions positions = referenceMask();
  for (std::size_t i = 0; i < kFeaturePointCount; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto r = static_cast<Eigen::Index>(i), c = static_cast<Eigen::Index>(axis);
      positions(r, c) += static_cast<double>(displaced[i][axis]) * scale(r, c);
    }
  return positions;
}

double moved_mm(const FeaturePointPositions& positions, std::string_view id) {
  return (positions.row(row(id)) - referenceMask().row(row(id))).norm();
}

std::string errorOf(const std::string& text) {
  try {
    ExpressionTable::parse(text, "t.csv");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

const std::string kHead = "shape,feature_point,x,y,z\n";

}  // namespace

TEST(ExpressionTable, EveryShapeSaysWhereItsNumbersComeFrom) {
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k)
    EXPECT_NE(ExpressionTable::standard().source(k), "") << kArkitBlendshapeNames[k];
}

TEST(ExpressionTable, OnlyTongueOutMovesNoPoint) {
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k)
    EXPECT_EQ(ExpressionTable::standard().movesMask(k), kArkitBlendshapeNames[k] != "tongueOut")
        << kArkitBlendshapeNames[k];
}

TEST(ExpressionTable, LeftShapesAreMirrorImagesOfRightOnesToTheBit) {
  const auto& basis = ExpressionTable::standard().basis();
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k)
    for (std::size_t i = 0; i < kFeaturePointCount; ++i) {
      const auto here = basis.block<3, 1>(static_cast<Eigen::Index>(3 * i), static_cast<Eigen::Index>(k));
      const auto there = basis.block<3, 1>(3 * static_cast<Eigen::Index>(featurePoints()[i].mirror),
                                           static_cast<Eigen::Index>(arkitMirrorIndex(k)));
      EXPECT_EQ(here.x(), -there.x() + 0.0) << kArkitBlendshapeNames[k] << " " << featurePoints()[i].id;
      EXPECT_EQ(here.y(), there.y()) << kArkitBlendshapeNames[k] << " " << featurePoints()[i].id;
      EXPECT_EQ(here.z(), there.z()) << kArkitBlendshapeNames[k] << " " << featurePoints()[i].id;
    }
}

TEST(ExpressionTable, BlinkClosesItsOwnEyeAndNothingElse) {
  const FeaturePointPositions blink = face("eyeBlinkLeft");
  const double open = referenceMask()(row("3.1"), 1) - referenceMask()(row("3.3"), 1);
  EXPECT_LT(std::abs(blink(row("3.1"), 1) - blink(row("3.3"), 1)), 0.12 * open);
  EXPECT_LT(moved_mm(blink, "3.2"), 0.05 * open);
  EXPECT_LT(moved_mm(blink, "8.3"), 0.05 * open);
  EXPECT_LT(moved_mm(blink, "2.1"), 0.05 * open);
}

TEST(ExpressionTable, JawOpenLowersChinAndLowerLipAndLeavesBrowsAlone) {
  const FeaturePointPositions open = face("jawOpen");
  EXPECT_LT(open(row("2.1"), 1), referenceMask()(row("2.1"), 1) - 15);
  EXPECT_LT(open(row("2.3"), 1), referenceMask()(row("2.3"), 1) - 15);
  EXPECT_LT(moved_mm(open, "2.2"), 6);
  EXPECT_LT(moved_mm(open, "4.3"), 1);
  EXPECT_LT(moved_mm(open, "12.13"), 1);
}

TEST(ExpressionTable, SmileLiftsAndWidensItsOwnCorner) {
  const FeaturePointPositions smile = face("mouthSmileLeft");
  EXPECT_GT(smile(row("8.3"), 0), referenceMask()(row("8.3"), 0) + 2);
  EXPECT_GT(smile(row("8.3"), 1), referenceMask()(row("8.3"), 1) + 3);
  EXPECT_LT(moved_mm(smile, "8.4"), 0.3 * moved_mm(smile, "8.3"));
}

TEST(ExpressionTable, BrowsRiseAndFall) {
  EXPECT_GT(face("browInnerUp")(row("4.1"), 1), referenceMask()(row("4.1"), 1) + 3);
  EXPECT_GT(face("browOuterUpRight")(row("12.4"), 1), referenceMask()(row("12.4"), 1) + 2);
  EXPECT_LT(face("browDownLeft")(row("4.1"), 1), referenceMask()(row("4.1"), 1) - 1.5);
}

TEST(ExpressionTable, PuckerNarrowsTheMouth) {
  const FeaturePointPositions pucker = face("mouthPucker");
  EXPECT_LT(pucker(row("8.3"), 0) - pucker(row("8.4"), 0), 0.85 * 52);
}

TEST(ExpressionTable, MouthCloseUndoesTheLipsOfJawOpen) {
  ArkitWeights weights{};
  weights[shape("jawOpen")] = 1;
  weights[shape("mouthClose")] = 1;
  MaskDisplacements both{};
  ExpressionTable::standard().apply(weights, both);
  const auto upper = static_cast<std::size_t>(row("2.2")), lower = static_cast<std::size_t>(row("2.3"));
  MaskDisplacements open{};
  weights[shape("mouthClose")] = 0;
  ExpressionTable::standard().apply(weights, open);
  EXPECT_LT(std::abs(both[upper][1] - both[lower][1]),
            0.25F * (open[upper][1] - open[lower][1]));  // lips together, jaw open
  EXPECT_LT(both[static_cast<std::size_t>(row("2.1"))][1], -0.5F);
}

TEST(ExpressionTable, WeightsAddUp) {
  const FeaturePointPositions half = face("jawOpen", 0.5F), whole = face("jawOpen");
  EXPECT_NEAR(((half - referenceMask()) * 2 - (whole - referenceMask())).cwiseAbs().maxCoeff(), 0, 1e-4);
}

TEST(ExpressionTableFile, BadRowsAreRefusedWithFileAndLine) {
  EXPECT_EQ(errorOf(kHead + "jawOpen,2.1,0,-1,0\n"), "");
  EXPECT_EQ(errorOf(kHead + "\xEF\xBB\xBF").substr(0, 6), "t.csv:");
  EXPECT_NE(errorOf(""), "");
  EXPECT_NE(errorOf(kHead), "");
  EXPECT_NE(errorOf(kHead + "jawOpened,2.1,0,-1,0\n").find("t.csv:2: \"jawOpened\""), std::string::npos);
  EXPECT_NE(errorOf(kHead + "jawOpen,3.5,0,-1,0\n").find("t.csv:2: \"3.5\""), std::string::npos);
  EXPECT_NE(errorOf(kHead + "jawOpen,2.1,0,-1\n").find("this one has 4"), std::string::npos);
  EXPECT_NE(errorOf(kHead + "jawOpen,2.1,0,-1,0,0\n").find("this one has 6"), std::string::npos);
  EXPECT_NE(errorOf(kHead + "jawOpen,2.1,0,nan,0\n").find("\"nan\" is not a finite number"), std::string::npos);
  EXPECT_NE(errorOf(kHead + "jawOpen,2.1,0,1e999,0\n").find("not a finite number"), std::string::npos);
  EXPECT_NE(errorOf(kHead + "jawOpen,2.1,0,1x,0\n").find("not a finite number"), std::string::npos);
  EXPECT_NE(errorOf(kHead + "jawOpen,2.1,0,-1,0\njawOpen,2.1,0,-1,0\n").find("t.csv:3: jawOpen has point 2.1 twice"),
            std::string::npos);
  EXPECT_NE(errorOf("jawOpen,2.1,0,-1,0\n").find("first row must be"), std::string::npos);
  EXPECT_NE(errorOf("# source smirk: me\n" + kHead).find("t.csv:1:"), std::string::npos);
}

}  // namespace volto::rig
