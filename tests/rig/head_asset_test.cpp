// The files in rig/assets are what the generator makes, to the byte.
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "rig/assets/head/head_mesh.h"
#include "tests/support/test_data.h"

namespace volto::head {
namespace {

std::string asset(const std::string& name) {
  std::ifstream file(test::sourceDir() / "rig/assets" / name, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// EXPECT_EQ would print a megabyte.
void expectSameBytes(const std::string& made, const std::string& stored, const std::string& name) {
  ASSERT_FALSE(stored.empty()) << name;
  std::size_t at = 0;
  while (at < made.size() && at < stored.size() && made[at] == stored[at]) ++at;
  EXPECT_TRUE(made == stored) << name << " differs at byte " << at << "; run volto-make-head rig/assets";
}

class HeadAsset : public ::testing::TestWithParam<Character> {};

TEST_P(HeadAsset, CommittedFilesAreWhatTheGeneratorMakes) {
  const Head head = makeHead(GetParam());
  const std::string& name = GetParam().file;
  expectSameBytes(objText(head, name + ".mtl"), asset(name + ".obj"), name + ".obj");
  expectSameBytes(mtlText(GetParam()), asset(name + ".mtl"), name + ".mtl");
  expectSameBytes(pointsText(head), asset(name + ".points.json"), name + ".points.json");
}

TEST_P(HeadAsset, SecondRunGivesTheSameBytes) {
  EXPECT_TRUE(objText(makeHead(GetParam()), "a.mtl") == objText(makeHead(GetParam()), "a.mtl"));
}

TEST_P(HeadAsset, StaysUnderTwoPointFourMegabytesAndWritesNoNegativeZero) {
  const std::string obj = asset(GetParam().file + ".obj");
  EXPECT_LT(obj.size(), 2'400'000U);
  EXPECT_EQ(obj.find("-0.00000"), std::string::npos);
  EXPECT_EQ(obj.find("nan"), std::string::npos);
}

TEST_P(HeadAsset, DefaultProportionsChangeNothing) {
  Character plain = GetParam();
  plain.proportions = {};
  const Head made = makeHead(plain), human = makeHead(adult());
  ASSERT_EQ(made.vertices.size(), human.vertices.size());
  for (std::size_t v = 0; v < made.vertices.size(); ++v) ASSERT_EQ(length(made.vertices[v] - human.vertices[v]), 0);
}

INSTANTIATE_TEST_SUITE_P(Of, HeadAsset, ::testing::Values(adult(), creature()),
                         [](const auto& which) { return which.param.file; });

}  // namespace
}  // namespace volto::head
