// P.json: every mistake gives one line that names it.
#include <gtest/gtest.h>

#include "rig/build_rig.h"

namespace volto::rig {
namespace {

std::string refused(const std::string& json) {
  try {
    parseFeaturePoints(json, "points.json");
  } catch (const InputError& e) {
    const std::string said = e.what();
    EXPECT_TRUE(said.starts_with("points.json: ")) << said;
    EXPECT_EQ(said.find('\n'), std::string::npos) << said;
    EXPECT_LT(said.size(), 500U);
    return said;
  }
  ADD_FAILURE() << "accepted: " << json.substr(0, 80);
  return {};
}

TEST(FeaturePointFile, VerticesAndPositionsAreRead) {
  const auto points =
      parseFeaturePoints(R"({"note": "mine", "feature_points": {"2.1": 4711, "12.20": [1, -2.5, 3e2]}})", "p");
  ASSERT_EQ(points.size(), 2U);
  EXPECT_EQ(std::get<std::uint32_t>(points.at(0)), 4711U);
  EXPECT_EQ(std::get<Eigen::Vector3d>(points.at(83)), Eigen::Vector3d(1, -2.5, 300));
}

TEST(FeaturePointFile, WhatInspectPrintsIsRead) {
  const auto points = parseFeaturePoints(
      R"({"feature_points": {"2.1": {"vertex": 7, "position": [1, 2, 3]}, "2.2": {"vertex": -1, "position": [1, 2, 3]}}})",
      "p");
  EXPECT_EQ(std::get<std::uint32_t>(points.at(0)), 7U);
  EXPECT_EQ(std::get<Eigen::Vector3d>(points.at(1)), Eigen::Vector3d(1, 2, 3));
}

TEST(FeaturePointFile, UnknownIdNamesTheNearest) {
  EXPECT_NE(refused(R"({"feature_points": {"12.21": 1}})").find("\"12.2"), std::string::npos);
  EXPECT_NE(refused(R"({"feature_points": {"3.5": 1}})").find("did you mean"), std::string::npos);
  EXPECT_NE(refused(R"({"feature_points": {")" + std::string(1'000'000, 'x') + R"(": 1}})"), "");
}

TEST(FeaturePointFile, RepeatedKeyIsRefused) {
  EXPECT_EQ(refused(R"({"feature_points": {"2.1": 1, "2.1": 2}})"), "points.json: \"2.1\" is given twice");
  EXPECT_NE(refused(R"({"feature_points": {}, "feature_points": {"2.1": 2}})"), "");
}

TEST(FeaturePointFile, WrongValuesNameTheirPoint) {
  for (const char* bad : {"-3", "4711.5", "1e3", "4294967296", "99999999999999999999", "\"4711\"", "null", "true",
                          "[1, 2]", "[1, 2, 3, 4]", "[1, 2, \"3\"]", "{}", "{\"vertex\": -1}"})
    EXPECT_NE(refused(std::string(R"({"feature_points": {"8.3": )") + bad + "}}").find("8.3"), std::string::npos)
        << bad;
}

TEST(FeaturePointFile, MalformedJsonNamesLineAndColumn) {
  EXPECT_NE(refused("{\"feature_points\":\n{\"2.1\": 4711,}}").find("line 2, column"), std::string::npos);
  for (const char* bad : {"", "{", "[", "nonsense", "{\"feature_points\": {\"2.1\": 1e400}}", "\xFF\xFE{}",
                          "{\"feature_points\": {\"2.1\": 1}} x", "{\"a\": \"\xC3\x28\"}"})
    EXPECT_NE(refused(bad), "") << bad;
}

TEST(FeaturePointFile, DeepNestingIsRefusedWithoutRecursion) {
  EXPECT_NE(refused(std::string(100'000, '[')), "");
  std::string deep;
  for (int i = 0; i < 100'000; ++i) deep += "{\"a\":";
  EXPECT_NE(refused(deep).find("nested"), std::string::npos);
}

TEST(FeaturePointFile, OtherShapesOfDocumentAreRefused) {
  for (const char* bad : {"[]", "5", "{}", R"({"feature_points": []})", R"({"points": {"2.1": 1}})"})
    EXPECT_NE(refused(bad), "") << bad;
}

}  // namespace
}  // namespace volto::rig
