#include "tools/pipeline/weights_csv.h"

#include <algorithm>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace volto::pipeline {
namespace {

std::string seconds(std::int64_t t_ns) {
  std::string text;
  appendSeconds(text, t_ns);
  return text;
}

TEST(WeightsCsv, SecondsAreExactAndHaveAtLeastFourDecimals) {
  EXPECT_EQ(seconds(0), "0.0000");
  EXPECT_EQ(seconds(16'700'000), "0.0167");
  EXPECT_EQ(seconds(16'666'667), "0.016666667");
  EXPECT_EQ(seconds(1'000'000'000), "1.0000");
  EXPECT_EQ(seconds(-1'500'000'000), "-1.5000");
  EXPECT_EQ(seconds(std::numeric_limits<std::int64_t>::min()), "-9223372036.854775808");
}

TEST(WeightsCsv, AShapeThatCannotBeSeenIsAnEmptyCellAndNotAZero) {
  std::string text;
  HeadPose head;
  head.observed = true;
  head.yaw_rad = static_cast<float>(std::numbers::pi / 6);
  head.roll_rad = -0.0F;
  appendWeightsRow(text, 0, std::vector<float>{0.25F, 0.5F, 0.0F}, std::vector<std::uint8_t>{1, 0, 1}, head);
  EXPECT_EQ(text, "0.0000,0.250000,,0.000000,30.0000,0.0000,0.0000\n");
}

TEST(WeightsCsv, AHeadThatWasNotSeenHasNoAngles) {
  std::string text;
  appendWeightsRow(text, 0, std::vector<float>{-1e-9F}, std::vector<std::uint8_t>{1}, HeadPose{});
  EXPECT_EQ(text, "0.0000,0.000000,,,\n");  // and no minus in front of a zero
}

TEST(WeightsCsv, MaskRowsHaveOneCellPerAxisOfEachPoint) {
  std::string header, row;
  appendMaskHeader(header);
  MaskFrame mask;
  mask.t_capture_ns = 500'000'000;
  mask.point_confidence.fill(1.0F);
  mask.point_confidence[1] = 0.0F;
  mask.displacement_fapu[0] = {0.1F, -0.2F, 0.3F};
  appendMaskRow(row, mask);
  EXPECT_EQ(header.substr(0, 36), "timestamp,2.1_x,2.1_y,2.1_z,2.2_x,2.");
  EXPECT_EQ(row.substr(0, 47), "0.5000,0.100000,-0.200000,0.300000,,,,0.000000,");
  EXPECT_EQ(std::count(header.begin(), header.end(), ','), 252);
  EXPECT_EQ(std::count(row.begin(), row.end(), ','), 252);
}

}  // namespace
}  // namespace volto::pipeline
