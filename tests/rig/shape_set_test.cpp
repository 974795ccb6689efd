#include "rig/shape_set.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "rig/errors.h"
#include "tests/support/test_data.h"

namespace volto::rig {
namespace {

ArkitObserved all() { return ArkitObserved().set(); }

struct Weights {
  std::vector<float> values;
  std::vector<std::uint8_t> observed;
};

Weights fromArkit(const ShapeSet& set, const ArkitWeights& arkit, const ArkitObserved& observed = all()) {
  Weights out{std::vector<float>(set.shapes().size()), std::vector<std::uint8_t>(set.shapes().size())};
  set.fromArkit(arkit, observed, out.values, out.observed);
  return out;
}

std::size_t indexOf(const ShapeSet& set, std::string_view name) {
  for (std::size_t k = 0; k < set.shapes().size(); ++k)
    if (set.shapes()[k].name == name) return k;
  ADD_FAILURE() << set.name() << " has no " << name;
  return 0;
}

ShapeSet parse(std::string rows) { return ShapeSet::parse("shape,arkit,weight\n" + rows, "own.csv"); }

std::string complaint(const std::string& text) {
  try {
    ShapeSet::parse(text, "own.csv", [](std::string_view, std::span<const std::string>) { return "jawOpen"; });
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

TEST(ShapeSet, ShippedSetsHaveTheShapesOfTheirStandards) {
  std::vector<std::pair<std::string, std::size_t>> found;
  for (const ShapeSet& set : ShapeSet::shipped()) {
    found.emplace_back(set.name(), set.shapes().size());
    std::set<std::string> names;
    for (const ShapeSet::Shape& shape : set.shapes()) EXPECT_TRUE(names.insert(shape.name).second) << shape.name;
  }
  EXPECT_EQ(found, (std::vector<std::pair<std::string, std::size_t>>{
                       {"arkit", 52}, {"facs", 31}, {"ict", 53}, {"vrm0", 17}, {"vrm1", 18}}));
  EXPECT_EQ(ShapeSet::shipped("vrm2"), nullptr);
}

TEST(ShapeSet, IctNamesAreThoseOfItsFiles) {
  VOLTO_REQUIRE_DATA(data);
  std::set<std::string> files, names;
  for (const auto& entry : std::filesystem::directory_iterator(data / "meshes/ict/expressions"))
    files.insert(entry.path().stem().string());
  for (const ShapeSet::Shape& shape : ShapeSet::shipped("ict")->shapes()) names.insert(shape.name);
  EXPECT_EQ(names, files);
}

TEST(ShapeSet, WhatEachSetCanSayComesBack) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0, 1);
  for (const ShapeSet& set : ShapeSet::shipped())
    for (int i = 0; i < 40; ++i) {
      // Three at a time, none of them one way, weak enough that no ARKit shape is cut at 1.
      std::vector<float> truth(set.shapes().size(), 0.0F);
      for (int j = 0; j < 3; ++j) {
        const std::size_t k = random() % truth.size();
        if (!set.shapes()[k].one_way && !set.shapes()[k].parts.empty()) truth[k] = 0.33F * unit(random);
      }
      // ARKit has no sides for these: what comes back is alike on both.
      for (const std::string split : {"browInnerUp", "cheekPuff"})
        if (set.name() == "ict") truth[indexOf(set, split + "_R")] = truth[indexOf(set, split + "_L")];
      ArkitWeights arkit;
      set.toArkit(truth, arkit);
      const Weights back = fromArkit(set, arkit);
      for (std::size_t k = 0; k < truth.size(); ++k)
        EXPECT_NEAR(back.values[k], truth[k], 4e-3) << set.name() << " " << set.shapes()[k].name;
    }
}

TEST(ShapeSet, ArkitSurvivesIct) {
  const ShapeSet& ict = *ShapeSet::shipped("ict");
  std::mt19937 random(4);
  std::uniform_real_distribution<float> unit(0, 1);
  const std::size_t tongue = *arkitBlendshapeIndex("tongueOut");
  for (int i = 0; i < 20; ++i) {
    ArkitWeights truth, back;
    for (float& w : truth) w = unit(random);
    ict.toArkit(fromArkit(ict, truth).values, back);
    for (std::size_t k = 0; k < truth.size(); ++k)
      EXPECT_NEAR(back[k], k == tongue ? 0.0F : truth[k], 1e-3) << kArkitBlendshapeNames[k];
  }
}

TEST(ShapeSet, PartsAddUpAndAreCutAtOne) {
  const ShapeSet set = parse("a,jawOpen,0.6\na,mouthFunnel,0.25\nb,jawOpen,0.5\nrest,-,0\n");
  ArkitWeights arkit;
  set.toArkit(std::vector<float>{0.5F, 0.5F, 1.0F}, arkit);
  EXPECT_FLOAT_EQ(arkit[*arkitBlendshapeIndex("jawOpen")], 0.55F);
  EXPECT_FLOAT_EQ(arkit[*arkitBlendshapeIndex("mouthFunnel")], 0.125F);
  set.toArkit(std::vector<float>{1.0F, 1.0F, 0.0F}, arkit);
  EXPECT_FLOAT_EQ(arkit[*arkitBlendshapeIndex("jawOpen")], 1.0F);
  EXPECT_EQ(std::count(arkit.begin(), arkit.end(), 0.0F), 50);
}

TEST(ShapeSet, AOneWayShapeIsUnderstoodAndNeverWritten) {
  const ShapeSet& vrm = *ShapeSet::shipped("vrm1");
  std::vector<float> weights(vrm.shapes().size(), 0.0F);
  weights[indexOf(vrm, "blink")] = 0.8F;
  ArkitWeights arkit;
  vrm.toArkit(weights, arkit);
  EXPECT_FLOAT_EQ(arkit[*arkitBlendshapeIndex("eyeBlinkLeft")], 0.8F);
  const Weights back = fromArkit(vrm, arkit);
  EXPECT_EQ(back.values[indexOf(vrm, "blink")], 0.0F);
  EXPECT_NEAR(back.values[indexOf(vrm, "blinkLeft")], 0.8F, 2e-3);
  EXPECT_NEAR(back.values[indexOf(vrm, "blinkRight")], 0.8F, 2e-3);
}

TEST(ShapeSet, WhatNobodySawIsNotObserved) {
  const ShapeSet set = parse("a,jawOpen,1\nb,cheekPuff,1\nc,jawOpen,0.3\nc,mouthFunnel,0.7\nrest,-,0\n");
  ArkitObserved observed;
  observed.set(*arkitBlendshapeIndex("jawOpen"));
  ArkitWeights arkit{};
  arkit[*arkitBlendshapeIndex("jawOpen")] = 0.5F;
  arkit[*arkitBlendshapeIndex("cheekPuff")] = 1.0F;
  const Weights back = fromArkit(set, arkit, observed);
  EXPECT_EQ(back.observed, (std::vector<std::uint8_t>{1, 0, 0, 0}));
  EXPECT_NEAR(back.values[0], 0.5F, 1e-3);
  EXPECT_EQ(back.values[1], 0.0F);
}

TEST(ShapeSet, ASetIsKnownByItsNames) {
  const auto setOf = [](std::vector<std::string> names) {
    const ShapeSet* set = shapeSetOf(names);
    return set == nullptr ? std::string() : set->name();
  };
  EXPECT_EQ(setOf({"jawOpen", "EyeBlinkLeft", "own"}), "arkit");
  EXPECT_EQ(setOf({"eyeBlink_L", "jawOpen", "browInnerUp_L"}), "ict");
  EXPECT_EQ(setOf({"aa", "ih", "happy"}), "vrm1");
  EXPECT_EQ(setOf({"a", "i", "joy", "blink_l"}), "vrm0");
  EXPECT_EQ(setOf({"AU12", "AU45"}), "facs");
  EXPECT_EQ(setOf({"grin", "leer", "jawOpen"}), "");
  EXPECT_EQ(setOf({}), "");
}

TEST(ShapeSet, BadRowsAreNamedByLine) {
  EXPECT_NE(complaint("").find("own.csv:1: no rows"), std::string::npos);
  EXPECT_NE(complaint("name,value\n").find("own.csv:1: the first row must be"), std::string::npos);
  const std::string head = "# mine\nshape,arkit,weight\n";
  EXPECT_NE(complaint(head).find("no rows"), std::string::npos);
  EXPECT_NE(complaint(head + "a,jawOpne,1\n")
                .find("own.csv:3: shape \"jawOpne\" is no ARKit blendshape; did you mean jawOpen?"),
            std::string::npos);
  EXPECT_NE(complaint(head + "a,jawOpen,1\na,jawOpen,1\n").find("own.csv:4: shape 'a' has jawOpen twice"),
            std::string::npos);
  for (const char* weight : {"-0.1", "1.5", "nan", "inf", "1x", ""})
    EXPECT_NE(complaint(head + "a,jawOpen," + weight + "\n").find("is no number from 0 to 1"), std::string::npos)
        << weight;
  EXPECT_NE(complaint(head + "a,jawOpen\n").find("3 columns"), std::string::npos);
  EXPECT_NE(complaint(head + "a,jawOpen,1,1\n").find("one_way"), std::string::npos);
  EXPECT_NE(complaint(head + ",jawOpen,1\n").find("1 to 200 bytes"), std::string::npos);
  EXPECT_NE(complaint(head + "a,jawOpen,1\na,-,0\n").find("has parts and none"), std::string::npos);
  std::string many = head;
  for (int i = 0; i <= 1000; ++i) many += "s" + std::to_string(i) + ",-,0\n";
  EXPECT_NE(complaint(many).find("own.csv:1003: more than 1000 shapes"), std::string::npos);
}

}  // namespace
}  // namespace volto::rig
