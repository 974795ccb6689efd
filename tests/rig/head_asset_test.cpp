// The files in rig/assets are what the generator makes, to the byte.
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "rig/assets/head/head_mesh.h"
#include "tests/support/test_data.h"

namespace volto::head {
namespace {

std::string asset(const char* name) {
  std::ifstream file(test::sourceDir() / "rig/assets" / name, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// EXPECT_EQ would print a megabyte.
void expectSameBytes(const std::string& made, const std::string& stored, const char* name) {
  ASSERT_FALSE(stored.empty()) << name;
  std::size_t at = 0;
  while (at < made.size() && at < stored.size() && made[at] == stored[at]) ++at;
  EXPECT_TRUE(made == stored) << name << " differs at byte " << at << "; run volto-make-head rig/assets";
}

TEST(HeadAsset, CommittedFilesAreWhatTheGeneratorMakes) {
  const Head head = makeHead();
  expectSameBytes(objText(head, "volto_head.mtl"), asset("volto_head.obj"), "volto_head.obj");
  expectSameBytes(mtlText(), asset("volto_head.mtl"), "volto_head.mtl");
  expectSameBytes(pointsText(head), asset("volto_head.points.json"), "volto_head.points.json");
}

TEST(HeadAsset, SecondRunGivesTheSameBytes) {
  EXPECT_TRUE(objText(makeHead(), "a.mtl") == objText(makeHead(), "a.mtl"));
}

TEST(HeadAsset, StaysUnderThreeMegabytesAndWritesNoNegativeZero) {
  const std::string obj = asset("volto_head.obj");
  EXPECT_LT(obj.size() + asset("volto_head.points.json").size() + asset("volto_head.mtl").size(), 3'000'000U);
  EXPECT_EQ(obj.find("-0.00000"), std::string::npos);
  EXPECT_EQ(obj.find("nan"), std::string::npos);
}

}  // namespace
}  // namespace volto::head
