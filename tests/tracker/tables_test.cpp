// The data that travel with the tracker: layouts, mean face, statistics of expressions, and what follows from them.
#include <set>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "tracker/expression_prior.h"
#include "tracker/landmark_layout.h"
#include "tracker/mean_face.h"
#include "tracker/observability.h"

namespace volto::tracker {
namespace {

std::string errorOf(auto&& call) {
  try {
    call();
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return "no error";
}

TEST(LandmarkLayouts, EachMeasuredPointHasALandmarkOfItsOwn) {
  for (const LandmarkLayout layout :
       {LandmarkLayout::ibug68, LandmarkLayout::openseeface66, LandmarkLayout::mediapipe478}) {
    std::set<int> used;
    for (const std::int16_t landmark : layoutTable(layout).landmark) {
      if (landmark < 0) continue;
      EXPECT_LT(static_cast<std::size_t>(landmark), landmarkCount(layout));
      EXPECT_TRUE(used.insert(landmark).second) << layoutName(layout) << " uses landmark " << landmark << " twice";
    }
    EXPECT_EQ(used.size(), layout == LandmarkLayout::openseeface66 ? 62U : 64U);
  }
}

TEST(LandmarkLayouts, AnUnknownLayoutIsNamed) {
  EXPECT_NE(errorOf([] { layoutTable(static_cast<LandmarkLayout>(9)); }).find("layout 9"), std::string::npos);
}

TEST(MeanFace, IsExactlySymmetric) {
  const rig::FeaturePointPositions& face = meanFace();
  const auto points = rig::featurePoints();
  for (std::size_t i = 0; i < kFeaturePointCount; ++i) {
    const auto here = static_cast<Eigen::Index>(i), there = static_cast<Eigen::Index>(points[i].mirror);
    EXPECT_EQ(face(here, 0), -face(there, 0)) << points[i].id;
    EXPECT_EQ(face(here, 1), face(there, 1)) << points[i].id;
    EXPECT_EQ(face(here, 2), face(there, 2)) << points[i].id;
  }
}

TEST(MeanFace, ATornFileIsRefusedWithItsLine) {
  EXPECT_NE(errorOf([] { parseMeanFace("feature_point,x,y,z\n2.1,0,1\n", "f.csv"); }).find("f.csv:2"),
            std::string::npos);
  EXPECT_NE(errorOf([] { parseMeanFace("feature_point,x,y,z\n2.1,0,nan,0\n", "f.csv"); }).find("nan"),
            std::string::npos);
  EXPECT_NE(errorOf([] { parseMeanFace("feature_point,x,y,z\n2.1,0,1,2\n", "f.csv"); }).find("84"), std::string::npos);
  EXPECT_NE(errorOf([] { parseMeanFace("", "f.csv"); }).find("f.csv"), std::string::npos);
}

TEST(ExpressionStatistics, ArePositiveDefiniteHoweverMuchCorrelationIsBelieved) {
  for (const double correlation : {0.0, 0.5, 0.9}) {
    EXPECT_EQ(ExpressionPrior::standard().secondMoment(correlation).llt().info(), Eigen::Success) << correlation;
    EXPECT_EQ(ExpressionPrior::standard().deviation(correlation).llt().info(), Eigen::Success) << correlation;
  }
}

TEST(ExpressionStatistics, LeftAndRightAreUsedAlike) {
  const ShapeMatrix moment = ExpressionPrior::standard().secondMoment(0.5);
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
    const auto m = static_cast<Eigen::Index>(arkitMirrorIndex(k));
    EXPECT_NEAR(moment(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(k)), moment(m, m), 1e-9)
        << kArkitBlendshapeNames[k];
  }
}

TEST(ExpressionStatistics, AFileOfOtherShapesIsRefused) {
  EXPECT_NE(errorOf([] { ExpressionPrior::parse("shape,rms\nsmile,0.1\n", "p.csv"); }).find("p.csv:2"),
            std::string::npos);
  EXPECT_NE(errorOf([] { ExpressionPrior::parse("", "p.csv"); }).find("52"), std::string::npos);
}

TEST(Observability, WhatSixtyEightPointsCannotShowIsNotReported) {
  const MeasuredPoints points = measuredPoints(layoutTable(LandmarkLayout::ibug68));
  const ArkitObserved observed = observableShapes(points, rig::ExpressionTable::standard(), false);
  for (const char* hidden : {"tongueOut", "cheekPuff", "jawForward", "eyeLookInLeft", "eyeLookOutRight"})
    EXPECT_FALSE(observed[arkitBlendshapeIndex(hidden).value()]) << hidden;
  for (const char* seen : {"jawOpen", "mouthSmileLeft", "eyeBlinkRight", "browInnerUp", "mouthPucker", "noseSneerLeft"})
    EXPECT_TRUE(observed[arkitBlendshapeIndex(seen).value()]) << seen;
}

TEST(Observability, DepthShowsTheJawComingForward) {
  const MeasuredPoints points = measuredPoints(layoutTable(LandmarkLayout::ibug68));
  EXPECT_TRUE(
      observableShapes(points, rig::ExpressionTable::standard(), true)[arkitBlendshapeIndex("jawForward").value()]);
}

}  // namespace
}  // namespace volto::tracker
