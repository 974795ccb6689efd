#include "tools/pipeline/latency_histogram.h"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace volto::pipeline {
namespace {

TEST(LatencyHistogram, PercentilesAgreeWithSortingToFivePercent) {
  std::mt19937 random(7);
  std::lognormal_distribution<double> duration(11.0, 1.2);  // around 60 us, with a long tail
  LatencyHistogram histogram;
  std::vector<std::int64_t> all;
  for (int i = 0; i < 20'000; ++i) {
    const auto value = static_cast<std::int64_t>(duration(random));
    all.push_back(value);
    histogram.add(value);
  }
  std::sort(all.begin(), all.end());
  for (const double fraction : {0.1, 0.5, 0.9, 0.99, 0.999}) {
    const double exact =
        static_cast<double>(all[static_cast<std::size_t>(fraction * static_cast<double>(all.size())) - 1]);
    EXPECT_NEAR(static_cast<double>(histogram.percentile(fraction)) / exact, 1.0, 0.05) << fraction;
  }
  EXPECT_EQ(histogram.percentile(1.0), all.back());
  EXPECT_EQ(histogram.maximum(), all.back());
  EXPECT_EQ(histogram.count(), all.size());
}

TEST(LatencyHistogram, EmptyOneAndOverlongValuesAreHarmless) {
  LatencyHistogram histogram;
  EXPECT_EQ(histogram.percentile(0.5), 0);
  histogram.add(0);
  EXPECT_EQ(histogram.percentile(0.5), 0);
  histogram.add(-5);  // a clock that went wrong
  histogram.add(std::int64_t{1} << 62);
  EXPECT_EQ(histogram.count(), 3U);
  EXPECT_EQ(histogram.maximum(), std::int64_t{1} << 62);
  EXPECT_LE(histogram.percentile(0.5), 1);
}

TEST(LatencyHistogram, AConstantIsReportedExactly) {
  LatencyHistogram histogram;
  for (int i = 0; i < 100; ++i) histogram.add(123'456);
  EXPECT_EQ(histogram.percentile(0.5), 123'456);
  EXPECT_EQ(histogram.percentile(0.99), 123'456);
}

}  // namespace
}  // namespace volto::pipeline
