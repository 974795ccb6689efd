#include "rig/fapu.h"

#include <limits>

#include <gtest/gtest.h>

#include "rig/control_mask.h"

namespace volto::rig {
namespace {

Eigen::Index row(std::string_view id) { return static_cast<Eigen::Index>(featurePointIndex(id).value()); }

}  // namespace

TEST(Fapu, ReferenceMaskHasHumanUnits) {
  // By hand from the coordinates in rig/control_mask.cpp.
  const FapuMeasurement measured = measureFapu(referenceMask());
  EXPECT_TRUE(measured.substitutions.empty());
  EXPECT_DOUBLE_EQ(measured.fapu.eye_separation, 62);
  EXPECT_DOUBLE_EQ(measured.fapu.iris_diameter, 11);
  EXPECT_DOUBLE_EQ(measured.fapu.eye_nose, 46);
  EXPECT_DOUBLE_EQ(measured.fapu.mouth_nose, 21);
  EXPECT_DOUBLE_EQ(measured.fapu.mouth_width, 52);
}

TEST(Fapu, UnitsGrowWithTheFaceAndIgnoreWhereItStands) {
  const FeaturePointPositions larger = (referenceMask() * 2.5).rowwise() + Eigen::RowVector3d(10, -20, 300);
  const Fapu fapu = measureFapu(larger).fapu;
  EXPECT_NEAR(fapu.eye_separation, 2.5 * 62, 1e-9);
  EXPECT_NEAR(fapu.mouth_nose, 2.5 * 21, 1e-9);
}

TEST(Fapu, EyesDrawnClosedGiveASubstituteNotInfinity) {
  FeaturePointPositions closed = referenceMask();
  for (const char* lid : {"3.1", "3.2", "3.3", "3.4"}) closed(row(lid), 1) = 0;
  const FapuMeasurement measured = measureFapu(closed);
  ASSERT_EQ(measured.substitutions.size(), 1U);
  EXPECT_NE(measured.substitutions[0].find("IRISD0"), std::string::npos);
  EXPECT_NEAR(measured.fapu.iris_diameter, 0.18 * 62, 0.2);
  EXPECT_TRUE((fapuScale(measured.fapu).array() > 0).all());
}

TEST(Fapu, NoGapBetweenNoseAndMouthGivesASubstitute) {
  FeaturePointPositions flat = referenceMask();
  flat(row("9.15"), 1) = flat(row("2.2"), 1) - 3;  // even below the mouth
  const FapuMeasurement measured = measureFapu(flat);
  EXPECT_EQ(measured.substitutions.size(), 1U);
  EXPECT_GT(measured.fapu.mouth_nose, 10);
}

TEST(Fapu, NothingCanBeMeasuredWithEyesInOnePlace) {
  EXPECT_THROW(measureFapu(FeaturePointPositions::Zero()), std::invalid_argument);
  FeaturePointPositions cyclops = referenceMask();
  for (const char* corner : {"3.7", "3.8", "3.11", "3.12"}) cyclops.row(row(corner)).setZero();
  EXPECT_THROW(measureFapu(cyclops), std::invalid_argument);
  FeaturePointPositions broken = referenceMask();
  broken(5, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(measureFapu(broken), std::invalid_argument);
}

TEST(Fapu, EachAxisOfAPointHasItsOwnUnit) {
  const FeaturePointPositions scale = fapuScale(measureFapu(referenceMask()).fapu);
  EXPECT_DOUBLE_EQ(scale(row("8.3"), 0), 52);   // lips: x in mouth widths
  EXPECT_DOUBLE_EQ(scale(row("8.3"), 1), 21);   // y in mouth-nose separations
  EXPECT_DOUBLE_EQ(scale(row("12.5"), 1), 11);  // lids: y in lid openings
  EXPECT_DOUBLE_EQ(scale(row("4.1"), 1), 46);   // brows: y in eye-nose separations
  EXPECT_DOUBLE_EQ(scale(row("9.3"), 2), 46);
}

}  // namespace volto::rig
