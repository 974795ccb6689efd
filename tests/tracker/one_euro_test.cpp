#include "tracker/one_euro.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace volto::tracker {
namespace {

constexpr OneEuroConstants kConstants{1.0, 1.0};
constexpr double kFrame_s = 1.0 / 60;

TEST(OneEuro, NoiseAtRestIsQuietened) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.01);
  OneEuro filter;
  double in = 0, out = 0;
  for (int i = 0; i < 2000; ++i) {
    const double value = noise(random);
    const double filtered = filter.push(value, kFrame_s, kConstants, 1);
    in += value * value;
    out += filtered * filtered;
  }
  EXPECT_LT(std::sqrt(out / in), 0.5);
}

TEST(OneEuro, AFastMoveIsHardlyLate) {
  OneEuro filter;
  filter.push(0, kFrame_s, kConstants, 1);
  double slow = 0;
  for (int i = 1; i <= 6; ++i) slow = filter.push(i / 6.0, kFrame_s, {1.0, 0.0}, 1);
  OneEuro quick;
  quick.push(0, kFrame_s, kConstants, 1);
  double fast = 0;
  for (int i = 1; i <= 6; ++i) fast = quick.push(i / 6.0, kFrame_s, {1.0, 10.0}, 1);
  EXPECT_LT(slow, 0.4);
  EXPECT_GT(fast, 0.75);
}

TEST(OneEuro, SmoothingZeroChangesNothing) {
  OneEuro filter;
  for (const double v : {0.0, 1.0, -3.0, 0.5}) EXPECT_EQ(filter.push(v, kFrame_s, kConstants, 0), v);
}

TEST(OneEuro, TheFirstValueAfterAResetIsTakenAsItIs) {
  OneEuro filter;
  filter.push(1, kFrame_s, kConstants, 1);
  filter.reset();
  EXPECT_EQ(filter.push(5, kFrame_s, kConstants, 1), 5);
}

}  // namespace
}  // namespace volto::tracker
