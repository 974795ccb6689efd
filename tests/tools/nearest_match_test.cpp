#include "tools/cli/nearest_match.h"

#include <vector>

#include <gtest/gtest.h>

namespace volto::cli {
namespace {

const std::vector<std::string> kVerbs{"rig", "replay", "record", "bake", "track", "inspect", "help"};

TEST(NearestMatch, FindsTheVerbThatWasMeant) {
  EXPECT_EQ(nearestMatch("rpelay", kVerbs), "replay");
  EXPECT_EQ(nearestMatch("inspekt", kVerbs), "inspect");
  EXPECT_EQ(nearestMatch("tracks", kVerbs), "track");
  EXPECT_EQ(nearestMatch("recrod", kVerbs), "record");
  EXPECT_EQ(nearestMatch("insp", kVerbs), "inspect");
}

TEST(NearestMatch, SaysNothingRatherThanSomethingFarOff) {
  EXPECT_EQ(nearestMatch("transmogrify", kVerbs), "");
  EXPECT_EQ(nearestMatch("x", kVerbs), "");
  EXPECT_EQ(nearestMatch("", kVerbs), "");
  EXPECT_EQ(nearestMatch(std::string(100'000, 'r'), kVerbs), "");
  EXPECT_EQ(nearestMatch("rig", {}), "");
}

}  // namespace
}  // namespace volto::cli
