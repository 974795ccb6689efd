#include "tools/pipeline/pacer.h"

#include <gtest/gtest.h>

namespace volto::pipeline {
namespace {

TEST(Pacer, RealTimeKeepsTheSpacingOfTheRecordingToTheNanosecond) {
  const Pacer pacer(1'000'000'007, 1.0);
  EXPECT_EQ(pacer.due(0), 1'000'000'007);
  EXPECT_EQ(pacer.due(3'600'000'000'001), 3'601'000'000'008);
}

TEST(Pacer, TwiceTheSpeedHalvesTheOffsets) {
  const Pacer pacer(100, 2.0);
  EXPECT_EQ(pacer.due(1000), 600);
  EXPECT_EQ(Pacer(100, 0.5).due(1000), 2100);
}

TEST(Pacer, ALateFrameDoesNotDelayTheOneAfterIt) {
  const std::int64_t start = monotonicNow();
  const Pacer pacer(start, 1.0);
  while (monotonicNow() < start + 20'000'000) {  // the first frame takes 20 ms ...
  }
  ASSERT_TRUE(pacer.wait(pacer.due(10'000'000)));  // ... so that this one is due already
  EXPECT_LT(monotonicNow(), start + 45'000'000);
  ASSERT_TRUE(pacer.wait(pacer.due(50'000'000)));
  EXPECT_GE(monotonicNow(), start + 50'000'000);
}

TEST(Pacer, WithoutAPaceEverythingIsDueNow) {
  const Pacer pacer(monotonicNow(), 0);
  const std::int64_t before = monotonicNow();
  EXPECT_TRUE(pacer.wait(pacer.due(3'600'000'000'000)));
  EXPECT_GE(pacer.due(3'600'000'000'000), before);
  EXPECT_LT(monotonicNow() - before, 1'000'000'000);
}

}  // namespace
}  // namespace volto::pipeline
